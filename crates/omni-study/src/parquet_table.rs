//! Rows as a Parquet file and back; the only module that names parquet.

use std::fs::File;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::Field;
use parquet::schema::types::Type;

use crate::key::VERSION;
use crate::{Cell, Column, Columns, Kind, Row, checksum};

/// Texts that go with a file, by name.
pub(crate) type Notes = Vec<(&'static str, String)>;

/// Rows as the bytes of one file, with its checksum.
pub(crate) fn written(columns: &Columns, notes: &Notes, rows: &[Row]) -> Result<Vec<u8>> {
    let notes = notes
        .iter()
        .map(|(name, text)| KeyValue::new((*name).to_owned(), text.clone()));
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_created_by(format!("omnistep version {VERSION}"))
        .set_key_value_metadata(Some(notes.collect()))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema(columns)?), Arc::new(properties))?;
    writer.write_all(&checksum::empty())?;
    let mut group = writer.next_row_group()?;
    let all = columns.all();
    let cells: Vec<Vec<Cell>> = rows.iter().map(Row::cells).collect();
    for (i, column) in all.iter().enumerate() {
        let Some(mut out) = group.next_column()? else {
            break;
        };
        let cells = || cells.iter().map(|row| &row[i]);
        let levels: Vec<i16> = cells().map(|cell| i16::from(*cell != Cell::Missing)).collect();
        let levels = (!required(column)).then_some(&*levels);
        match column.kind {
            Kind::Bool => {
                let values: Vec<bool> = cells()
                    .filter_map(|cell| if let Cell::Bool(v) = cell { Some(*v) } else { None })
                    .collect();
                out.typed::<BoolType>().write_batch(&values, levels, None)?;
            }
            Kind::Integer => {
                let values: Vec<i64> = cells()
                    .filter_map(|cell| {
                        if let Cell::Integer(v) = cell {
                            Some(*v)
                        } else {
                            None
                        }
                    })
                    .collect();
                out.typed::<Int64Type>().write_batch(&values, levels, None)?;
            }
            Kind::Float => {
                let values: Vec<f64> = cells()
                    .filter_map(|cell| if let Cell::Float(v) = cell { Some(*v) } else { None })
                    .collect();
                out.typed::<DoubleType>().write_batch(&values, levels, None)?;
            }
            Kind::Text => {
                let text = |cell: &Cell| {
                    if let Cell::Text(v) = cell {
                        Some(ByteArray::from(v.as_str()))
                    } else {
                        None
                    }
                };
                let values: Vec<ByteArray> = cells().filter_map(text).collect();
                out.typed::<ByteArrayType>().write_batch(&values, levels, None)?;
            }
        }
        out.close()?;
    }
    group.close()?;
    let mut bytes = writer.into_inner()?;
    checksum::close(&mut bytes);
    Ok(bytes)
}

/// A file that was opened and whose end is there.
pub(crate) struct Opened(SerializedFileReader<File>);

/// Opens a file.
pub(crate) fn open(file: File) -> Result<Opened> {
    Ok(Opened(SerializedFileReader::new(file)?))
}

impl Opened {
    /// A text that goes with the file.
    pub(crate) fn note(&self, name: &str) -> Option<&str> {
        let notes = self.0.metadata().file_metadata().key_value_metadata()?;
        notes.iter().find(|note| note.key == name)?.value.as_deref()
    }

    /// The first column that is in the file or in `columns` but not in both, if any.
    pub(crate) fn difference(&self, columns: &Columns) -> Result<Option<String>> {
        let (here, there) = (schema(columns)?, self.0.metadata().file_metadata().schema());
        let names = |schema: &Type, other: &Type| {
            let missing = schema
                .get_fields()
                .iter()
                .find(|field| !other.get_fields().contains(field));
            missing.map(|field| field.name().to_owned())
        };
        Ok(names(there, &here).or_else(|| names(&here, there)))
    }

    /// Its rows.
    pub(crate) fn rows(&self, columns: &Columns) -> Result<Vec<Row>> {
        let rows = self.0.get_row_iter(None)?;
        rows.map(|row| {
            let cells = row?
                .into_columns()
                .into_iter()
                .map(|(name, field)| cell(&name, field));
            from_cells(cells.collect::<Result<Vec<_>>>()?, columns)
        })
        .collect()
    }
}

/// Never null.
fn required(column: &Column) -> bool {
    column.name == "key" || column.name == "seed"
}

fn schema(columns: &Columns) -> Result<Type> {
    let field = |column: &Column| {
        let (physical, logical) = match column.kind {
            Kind::Bool => (Physical::BOOLEAN, None),
            Kind::Integer => (Physical::INT64, None),
            Kind::Float => (Physical::DOUBLE, None),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = if required(column) {
            Repetition::REQUIRED
        } else {
            Repetition::OPTIONAL
        };
        let built = Type::primitive_type_builder(&column.name, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(built))
    };
    let fields = columns.all().iter().map(field).collect::<Result<_>>()?;
    Type::group_type_builder("run").with_fields(fields).build()
}

fn cell(name: &str, field: Field) -> Result<Cell> {
    Ok(match field {
        Field::Null => Cell::Missing,
        Field::Bool(value) => Cell::Bool(value),
        Field::Long(value) => Cell::Integer(value),
        Field::Double(value) => Cell::Float(value),
        Field::Str(text) => Cell::Text(text),
        _ => return Err(ParquetError::General(format!("column {name} is of another type"))),
    })
}

fn from_cells(cells: Vec<Cell>, columns: &Columns) -> Result<Row> {
    let mut cells = cells.into_iter();
    let (Some(Cell::Text(key)), Some(Cell::Integer(seed))) = (cells.next(), cells.next()) else {
        return Err(ParquetError::General("a row without key or seed".into()));
    };
    let axes = cells.by_ref().take(columns.axes.len()).collect();
    let metrics = cells.by_ref().take(columns.metrics.len()).collect();
    Ok(Row {
        key,
        seed: u64::try_from(seed).map_err(|_| ParquetError::General(format!("seed {seed}")))?,
        axes,
        metrics,
        error: match cells.next() {
            Some(Cell::Text(text)) => Some(text),
            _ => None,
        },
    })
}
