//! Three rows of any length for serde, which supports only arrays of given lengths.

use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_big_array::{Array, BigArray};

#[derive(Serialize)]
#[serde(transparent, bound = "R: Serialize")]
struct Row<'a, R, const N: usize>(#[serde(serialize_with = "row")] &'a [R; N]);

fn row<S: Serializer, R: Serialize, const N: usize>(row: &&[R; N], to: S) -> Result<S::Ok, S::Error> {
    BigArray::serialize(*row, to)
}

pub(super) fn serialize<S: Serializer, R: Serialize, const N: usize>(
    rows: &[[R; N]; 3],
    to: S,
) -> Result<S::Ok, S::Error> {
    let mut three = to.serialize_tuple(3)?;
    for row in rows {
        three.serialize_element(&Row(row))?;
    }
    three.end()
}

pub(super) fn deserialize<'de, D: Deserializer<'de>, R: Deserialize<'de>, const N: usize>(
    from: D,
) -> Result<[[R; N]; 3], D::Error> {
    <[Array<R, N>; 3] as Deserialize>::deserialize(from).map(|rows| rows.map(|row| row.0))
}
