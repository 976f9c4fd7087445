"""Wrong calls from Python: each is one line that names the argument and what it takes."""

from pathlib import Path
from typing import Any

import pytest
from a_run import a_run
from bundled import bundled

import sssi_exudyn
from sssi_exudyn.api.result import Result
from sssi_exudyn.model.from_recording import model_of

BEGINNER = str(Path(__file__).parents[2] / "examples" / "beginner")
WRONG: list[tuple[str, tuple[Any, ...], dict[str, Any], str]] = [
    ("turn", ("x",), {"edge_deg": 5}, "turn: got an unexpected keyword argument 'edge_deg'; did you mean 'edge'?"),
    ("turn", (5,), {}, "turn: skis: 5 cannot be used here; give a path or a list, each a path"),
    ("turn", ([],), {}, "turn: skis: it is empty; give one or more"),
    ("turn", ("x",), {"speed": "fast"}, "turn: speed: 'fast' cannot be used here; give a number"),
    ("simulate", ("x",), {"snow": "ice"}, "simulate: snow: 'ice' cannot be used here; give 'paper' or 'carving'"),
    ("simulate", ("x",), {"csv": "no"}, "simulate: csv: 'no' cannot be used here; give True or False"),
    (
        "simulate",
        (5,),
        {},
        "argument: recording: a value of type int is no recording; give a Recording, or the path of one",
    ),
    (
        "muscles",
        (5.0,),
        {},
        "argument: recording: a value of type float is no recording; give a Recording, or the path of one",
    ),
    (
        "simulate",
        (BEGINNER,),
        {"terms": [sssi_exudyn.FootTerm]},
        "terms: FootTerm: it is no force term; give an object of its class, or a name",
    ),
    ("fit", ("x",), {"method": "x"}, "fit: method: 'x' cannot be used here; give 'joint' or 'paper'"),
    ("fit", ("x",), {"parameters": "a.c"}, "fit: parameters: 'a.c' cannot be used here; give a list, each a text"),
    ("run", ("x", 5), {}, "run: out: 5 cannot be used here; give a path"),
    (
        "build",
        ("x",),
        {"seconds": 4.0},
        "argument: seconds: '4.0' is no stretch of time such as 3:12.5 (s); give two times of the recording's clock",
    ),
    ("load", (5,), {}, "load: folder: 5 cannot be used here; give a path"),
    ("report", (5, "x"), {}, "report: results: a int is no result; give results, or the paths of their folders"),
    ("report", ([], "x"), {}, "report: results: it is empty; give one or more"),
    ("identify", (5,), {}, "identify: folder: 5 cannot be used here; give a path"),
    ("example", (5,), {}, "example: name: 5 cannot be used here; give a text"),
    ("import_files", ([], "x"), {}, "import_files: files: it is empty; give one or more"),
    ("import_day", (5, "x"), {}, "import_day: files: 5 cannot be used here; give a path or a list, each a path"),
    (
        "validate",
        ("x", "y"),
        {},
        "validate: missing a required argument: 'out'; the arguments are: recording, result, out, progress",
    ),
    ("sweep", (5, "x"), {}, "sweep: file: 5 cannot be used here; give a path or a table of names and values"),
    ("terms", ("x",), {}, "terms: too many positional arguments; the arguments are: none"),
]


@pytest.mark.parametrize(("name", "args", "kwargs", "message"), WRONG)
def test_a_wrong_call_is_one_line(name: str, args: tuple[Any, ...], kwargs: dict[str, Any], message: str) -> None:
    with pytest.raises(sssi_exudyn.InputError) as raised:
        getattr(sssi_exudyn, name)(*args, **kwargs)
    assert str(raised.value) == message


@pytest.mark.parametrize(
    ("method", "given"),
    [("save", 5), ("report", 5), ("to_csv", 5), ("to_excel", 5), ("to_gltf", 5), ("over_turns", 5), ("plot", 3)],
)
def test_methods_of_a_result_name_what_is_wrong(method: str, given: object) -> None:
    with pytest.raises(sssi_exudyn.InputError, match=f"^{method}: .*{given}"):
        getattr(Result(a_run(4.0), {}), method)(given)


@pytest.mark.parametrize(
    ("values", "message"),
    [(5, "model: values: a int is no mapping"), ({3: 1.0}, "model: 3: the model has no such term")],
)
def test_values_of_a_model_have_names(values: Any, message: str) -> None:
    with pytest.raises(sssi_exudyn.InputError, match=message):
        sssi_exudyn.model_of(BEGINNER).with_values(values)


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("friction.mu_t", 5.0, "5 is outside 0.01 to 0.99 1"),
        ("air.c_d", -1.0, "-1 is outside 0.1 to 2 1"),
        ("start.velocity_f", 1e6, "1e+06 is outside -50 to 50 m/s"),
    ],
)
def test_a_number_outside_its_bounds_is_refused_where_the_model_is_used(name: str, value: float, problem: str) -> None:
    recording, motion = bundled("beginner")
    model = model_of(recording, motion).with_values({name: value})
    for use in (sssi_exudyn.simulate, sssi_exudyn.fit, sssi_exudyn.build):
        with pytest.raises(sssi_exudyn.InputError) as raised:
            use(recording, model=model)
        assert str(raised.value) == f"model: {name}: {problem}; correct the value or its unit"


def test_a_ski_may_be_given_as_a_path() -> None:
    with pytest.raises(sssi_exudyn.InputError, match=r"my\.toml: the file does not exist"):
        sssi_exudyn.turn(Path("my.toml"), edge=50)


def test_items_of_the_exudyn_model_have_names() -> None:
    # the class alone: a model in Exudyn takes seconds to build
    from sssi_exudyn.simulation.full.open_model import Numbers

    numbers = Numbers(skier=3)
    assert numbers["skier"] == 3
    with pytest.raises(
        sssi_exudyn.InputError, match="model: skierr: there is nothing of that name; did you mean 'skier'"
    ):
        numbers["skierr"]
