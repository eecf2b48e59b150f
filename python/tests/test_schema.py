"""The JSON Schemas that `omnistep schema` prints, as a foreign validator reads them."""

import copy
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

ROOT = Path(__file__).resolve().parents[2]
ASSETS = ROOT / "crates/omni-config/assets"
FILES = {
    "vehicle": sorted([*(ASSETS / "vehicles").glob("*.toml"), ROOT / "firmware/embassy/vehicle/omni4.toml"]),
    "scenario": [p for p in sorted((ASSETS / "scenarios").glob("*.toml")) if p.stem != "motor_bench"],
    "experiment": [ASSETS / "scenarios/motor_bench.toml"],
}


@pytest.fixture(scope="module")
def validators() -> dict[str, Draft202012Validator]:
    """A validator a kind of file, its schema valid itself."""
    found = {}
    for kind in FILES:
        command = [sys.executable, "-m", "omnistep", "schema", kind]
        schema = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        Draft202012Validator.check_schema(schema)
        found[kind] = Draft202012Validator(schema)
    return found


@pytest.mark.parametrize(("kind", "path"), [(kind, path) for kind, paths in FILES.items() for path in paths])
def test_every_built_in_file_is_valid(validators, kind, path):
    assert len(FILES["vehicle"]) >= 5
    errors = [error.message for error in validators[kind].iter_errors(tomllib.loads(path.read_text()))]
    assert errors == []


def tables(value, path=()):
    """Every table of a file with its path."""
    if isinstance(value, dict):
        yield path, value
        for key, inner in value.items():
            yield from tables(inner, (*path, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from tables(inner, (*path, index))


def at(value, path):
    for key in path:
        value = value[key]
    return value


@pytest.mark.parametrize(("kind", "path"), [(kind, path) for kind, paths in FILES.items() for path in paths])
def test_unknown_keys_and_wrong_types_are_refused_in_every_table(validators, kind, path):
    whole = tomllib.loads(path.read_text())
    for place, table in tables(whole):
        if (kind, place) == ("scenario", ("set",)):
            continue  # keys of the vehicle
        other = copy.deepcopy(whole)
        at(other, place)["nonsense"] = 1
        assert not validators[kind].is_valid(other), place
        for key, value in table.items():
            if (kind, key) == ("scenario", "vehicle"):
                continue  # a name or a table
            other = copy.deepcopy(whole)
            at(other, place)[key] = 1 if isinstance(value, str) else "one"
            assert not validators[kind].is_valid(other), (place, key)


def test_a_scenario_takes_a_whole_vehicle_in_place_of_a_name(validators):
    scenario = tomllib.loads((ASSETS / "scenarios/flat.toml").read_text())
    scenario["vehicle"] = tomllib.loads((ASSETS / "vehicles/rocker_bogie6.toml").read_text())
    assert validators["scenario"].is_valid(scenario)
    scenario["vehicle"]["wheel"][0]["contact"] = {"kind": "cube"}
    assert not validators["scenario"].is_valid(scenario)
