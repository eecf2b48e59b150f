//! Traces and rows of studies by the Arrow PyCapsule interface: any data frame takes them; traces on their own memory.

use std::ptr::NonNull;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, RecordBatchIterator, StringArray,
};
use arrow_buffer::{Buffer, ScalarBuffer};
use arrow_schema::{DataType, Field, Schema};
use omni_study::{Cell, Column, Kind, Row};
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
    capsule(py, schema, columns)
}

fn capsule(py: Python<'_>, schema: Arc<Schema>, columns: Vec<ArrayRef>) -> PyResult<Bound<'_, PyCapsule>> {
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
    // SAFETY: the bytes are those of the trace's column, aligned for f64; the trace is never
    // changed, and the buffer keeps it.
    let buffer =
        unsafe { Buffer::from_custom_allocation(start, std::mem::size_of_val(values), trace.clone()) };
    Arc::new(Float64Array::new(
        ScalarBuffer::new(buffer, 0, values.len()),
        None,
    ))
}

/// A stream of one batch of a study's rows; what was not measured is null.
pub(crate) fn of_rows<'py>(
    py: Python<'py>,
    columns: &[Column],
    rows: &[Row],
) -> PyResult<Bound<'py, PyCapsule>> {
    let cells: Vec<Vec<Cell>> = rows.iter().map(Row::cells).collect();
    let mut fields = Vec::with_capacity(columns.len());
    let mut arrays: Vec<ArrayRef> = Vec::with_capacity(columns.len());
    for (i, column) in columns.iter().enumerate() {
        let cells = cells.iter().map(|row| &row[i]);
        let array: ArrayRef = match column.kind {
            Kind::Bool => {
                let of = |cell: &Cell| if let Cell::Bool(v) = cell { Some(*v) } else { None };
                Arc::new(cells.map(of).collect::<BooleanArray>())
            }
            Kind::Integer => {
                let of = |cell: &Cell| {
                    if let Cell::Integer(v) = cell {
                        Some(*v)
                    } else {
                        None
                    }
                };
                Arc::new(cells.map(of).collect::<Int64Array>())
            }
            Kind::Float => {
                let of = |cell: &Cell| if let Cell::Float(v) = cell { Some(*v) } else { None };
                Arc::new(cells.map(of).collect::<Float64Array>())
            }
            Kind::Text => {
                fn of(cell: &Cell) -> Option<&str> {
                    if let Cell::Text(v) = cell { Some(v) } else { None }
                }
                Arc::new(cells.map(of).collect::<StringArray>())
            }
        };
        fields.push(Field::new(&column.name, array.data_type().clone(), true));
        arrays.push(array);
    }
    capsule(py, Arc::new(Schema::new(fields)), arrays)
}
