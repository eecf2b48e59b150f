"""Every example of every docstring does what it says."""

import ast
import doctest
import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import omnistep
from omnistep import _omnistep

STUB = Path(omnistep.__file__).with_name("_omnistep.pyi")
MODULES = ["omnistep", *(f"omnistep.{module.name}" for module in pkgutil.iter_modules(omnistep.__path__))]
DEFINITIONS = (ast.ClassDef, ast.FunctionDef)


def stub_examples():
    for node in ast.walk(ast.parse(STUB.read_text())):
        text = ast.get_docstring(node) if isinstance(node, DEFINITIONS) else None
        if text and ">>>" in text:
            yield pytest.param(node.name, text, node.lineno, id=node.name)


def failures(test):
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said = []
    runner.run(test, out=said.append)
    return "".join(said)


@pytest.mark.parametrize(("name", "text", "line"), list(stub_examples()))
def test_an_example_of_the_compiled_part_holds(name, text, line):
    test = doctest.DocTestParser().get_doctest(text, {}, name, str(STUB), line)
    assert test.examples
    assert failures(test) == ""


@pytest.mark.parametrize("name", [name for name in MODULES if not name.endswith(("_omnistep", "__main__"))])
def test_the_examples_of_a_module_hold(name):
    module = importlib.import_module(name)
    for test in doctest.DocTestFinder(exclude_empty=True).find(module, globs={}):
        assert failures(test) == "", test.name


def test_every_public_class_and_function_has_an_example_or_is_made_by_one_that_has():
    # What only calls hand out is shown where it is handed out.
    handed_out = {
        "ClimbLimits",
        "Calibration",
        "ControlSample",
        "Desaturated",
        "Difference",
        "Follow",
        "Identification",
        "ImportSummary",
        "ImportedSignal",
        "MotorDuty",
        "Outcome",
        "PidSample",
        "Resimulation",
        "Sample",
        "ShapedCommands",
        "Trace",
        "TrajectorySample",
        "TuneResult",
        "MotorBenchTrace",
    }
    stub = {name.values[0] for name in stub_examples()}
    missing = []
    for name in set(omnistep.__all__) - handed_out - {"__version__", "plot"}:
        thing = getattr(omnistep, name)
        if isinstance(thing, type) and issubclass(thing, Exception):
            continue
        if name not in stub and ">>>" not in (thing.__doc__ or ""):
            missing.append(name)
    assert sorted(missing) == []


def documented():
    """Every definition of the stub that has a docstring, with its class."""
    for node in ast.parse(STUB.read_text()).body:
        if isinstance(node, DEFINITIONS):
            yield "", node
        if isinstance(node, ast.ClassDef):
            yield from ((node.name, member) for member in node.body if isinstance(member, DEFINITIONS))


def test_help_says_what_the_stub_says():
    compared, other = 0, []
    for owner, node in documented():
        text = ast.get_docstring(node)
        if text is None:
            continue
        if node.name.startswith("__"):
            continue  # Python has words of its own for these
        thing = getattr(_omnistep, owner or node.name)
        if owner:
            member = vars(thing)[node.name]
            thing = getattr(thing, node.name) if isinstance(member, staticmethod) else member
        compared += 1
        if inspect.cleandoc(getattr(thing, "__doc__", None) or "") != text:
            other.append(f"{owner}.{node.name}")
    # python scripts/docs/docstrings.py copies them.
    assert compared > 200 and other == []
