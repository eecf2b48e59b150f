"""Traces in other packages' data frames."""

import gc

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import omnistep


@pytest.fixture(scope="module")
def trace():
    return omnistep.run("flat", overrides={"duration_s": 0.5})


def test_arrow_and_polars_have_the_traces_own_memory(trace):
    table = pa.table(trace)
    assert table.column_names == trace.names and table.num_rows == len(trace)
    assert trace.to_arrow().equals(table)
    frame = trace.to_polars()
    assert isinstance(frame, pl.DataFrame) and frame.columns == trace.names
    for name in (trace.names[0], "wheel_4_applied_n_m", trace.names[-1]):
        address = trace[name].ctypes.data
        assert table[name].chunk(0).buffers()[1].address == address, name
        assert trace.to_arrow()[name].chunk(0).buffers()[1].address == address, name
        assert frame[name].to_numpy(allow_copy=False).ctypes.data == address, name
        assert table.schema.field(name).type == pa.float64() and not table.schema.field(name).nullable


def test_numpy_has_every_column_side_by_side_and_cannot_write(trace):
    whole = trace.to_numpy()
    assert whole.shape == (len(trace), len(trace.names))
    for number, name in enumerate(trace.names):
        assert np.shares_memory(whole[:, number], trace[name])
        assert np.array_equal(whole[:, number], trace[name])
    with pytest.raises(ValueError, match="read-only"):
        whole[0, 0] = 1.0


def test_pandas_and_duckdb_have_the_same_numbers(trace):
    frame = trace.to_pandas()
    assert isinstance(frame, pd.DataFrame) and list(frame.columns) == trace.names
    assert np.array_equal(frame.to_numpy(), trace.to_numpy())
    signals = pa.table(trace)  # duckdb finds it by its name
    rows = duckdb.sql("select max(twist_vx_m_s), count(*) from signals").fetchall()
    assert rows == [(trace["twist_vx_m_s"].max(), len(signals))]


def test_frames_outlive_the_trace():
    trace = omnistep.run("flat", overrides={"duration_s": 0.1})
    expected = trace["pose_x_m"].copy()
    table, frame, whole = pa.table(trace), trace.to_polars(), trace.to_numpy()
    column = trace.names.index("pose_x_m")
    del trace
    gc.collect()
    assert np.array_equal(table["pose_x_m"].to_numpy(), expected)
    assert np.array_equal(frame["pose_x_m"].to_numpy(), expected)
    assert np.array_equal(whole[:, column], expected)


def test_metrics_are_the_outcomes(trace):
    metrics, outcome = trace.metrics(), trace.outcome.to_dict()
    assert metrics.keys() == outcome.keys() and metrics["verdict"] == "completed"
    assert all(np.array_equal(metrics[key], outcome[key], equal_nan=isinstance(outcome[key], float)) for key in outcome)
