//! Traces by the Arrow PyCapsule interface: any data frame takes them, on the trace's own memory.

use std::ptr::NonNull;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, RecordBatchIterator};
use arrow_buffer::{Buffer, ScalarBuffer};
use arrow_schema::{DataType, Field, Schema};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// A stream of one batch whose columns are the trace's memory.
pub(crate) fn stream<'py>(py: Python<'py>, trace: &Arc<omni_sim::Trace>) -> PyResult<Bound<'py, PyCapsule>> {
    let fields: Vec<_> = trace
        .names()
        .iter()
        .map(|name| Field::new(name, DataType::Float64, false))
        .collect();
    let schema = Arc::new(Schema::new(fields));
    let columns = (0..trace.names().len())
        .map(|index| column(trace, index))
        .collect();
    let failed = |error: arrow_schema::ArrowError| PyValueError::new_err(error.to_string());
    let batch = RecordBatch::try_new(schema.clone(), columns).map_err(failed)?;
    let batches = RecordBatchIterator::new([Ok(batch)], schema);
    PyCapsule::new_with_value(
        py,
        FFI_ArrowArrayStream::new(Box::new(batches)),
        c"arrow_array_stream",
    )
}

fn column(trace: &Arc<omni_sim::Trace>, index: usize) -> ArrayRef {
    let values = trace.column_at(index);
    let start = NonNull::from(values).cast::<u8>();
    #[expect(unsafe_code, reason = "a borrow without a copy, as in trace.rs")]
    // SAFETY: the bytes are those of the trace's column, aligned for f64; the trace is never changed, and the buffer keeps it.
    let buffer =
        unsafe { Buffer::from_custom_allocation(start, std::mem::size_of_val(values), trace.clone()) };
    Arc::new(Float64Array::new(
        ScalarBuffer::new(buffer, 0, values.len()),
        None,
    ))
}
