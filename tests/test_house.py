"""The layout of the code: who may import whom, and how large anything may grow."""

from __future__ import annotations

import ast
import re
import subprocess
from collections import UserDict
from collections.abc import Collection, Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.count import BUDGET, Budget, Count, counts
from tests.tolerances import REASONS

PACKAGE = Path(__file__).resolve().parent.parent / "fibrefit"

FLOORS = {
    "core": 0,
    "study": 1,
    "records": 1,
    "laws": 1,
    "rigs": 2,
    "simulation": 3,
    "problem": 4,
    "fitting": 5,
    "sampling": 5,
    "discovery": 6,
    "series": 7,
    "store": 8,
    "plots": 8,
    "tables": 8,
    "report": 8,
    "workflow": 9,
    "cli": 10,
}

#: Packages that only some of ours may import. Units live in core, next to the numbers they belong to.
SOLE_IMPORTERS = {
    "h5py": {"store", "records.files.hdf5"},
    "matplotlib": {"plots"},
    "optimistix": {"fitting"},
    "emcee": {"sampling"},
    "jinja2": {"report"},
    "pandas": {"tables", "workflow", "records.files.block"},
    "xarray": {"tables"},
    "pydantic": {"study"},
    "pint": {"core.units"},
    "click": {"cli"},
    "rich": {"cli"},
}

#: Floors that must do without JAX: its import alone takes longer than what they do.
WITHOUT_JAX = ("study", "records", "store", "plots", "report", "tables", "cli")

#: The root package and its `__main__` stand above all floors.
ABOVE = {"", "__main__"}

LONGEST_FUNCTION = 100
LONGEST_FILE = 700
MOST_FILES = 16
MOST_ARGUMENTS = 6

#: Rooms of any size: one file a command, one a picture.
ONE_FILE_A_THING = ("cli", "plots")


def name_of(path: Path) -> str:
    """Dotted name below the root: ``study/load.py`` is ``study.load``."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


class Trees(UserDict[str, ast.Module]):
    """Modules by name; each is parsed when it is first asked for."""

    def __init__(self, paths: dict[str, Path]) -> None:
        self.paths = paths
        super().__init__(dict.fromkeys(paths, ast.Module([], [])))

    def __getitem__(self, name: str) -> ast.Module:
        if path := self.paths.pop(name, None):
            self.data[name] = ast.parse(path.read_text(encoding="utf-8"))
        return self.data[name]

    def __setitem__(self, name: str, tree: ast.Module) -> None:
        self.data[name] = tree


MODULES = Trees({name_of(path): path for path in sorted(PACKAGE.rglob("*.py"))})


def by_floor(modules: Collection[str]) -> list[object]:
    """Modules of each floor, a test for all of them: thousands of tests of a millisecond take a minute to hand out."""
    floors = sorted({module.partition(".")[0] for module in modules})
    return [
        pytest.param([module for module in sorted(modules) if module.partition(".")[0] == floor], id=floor or "root")
        for floor in floors
    ]


def imports(module: str, *, at_import_only: bool = False, for_types: bool = True) -> Iterator[str]:
    """Dotted names `module` imports: inside functions unless only import time counts, and those for types if asked."""
    tree = MODULES[module]
    is_package = any(other.startswith(f"{module}.") for other in MODULES)
    for node in _statements(tree, not at_import_only, for_types and not at_import_only):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                here = module.split(".") if is_package else module.split(".")[:-1]
                base = ".".join(["fibrefit", *here[: len(here) - node.level + 1], *([base] if base else [])])
            names = [f"{base}.{alias.name}" for alias in node.names]
            # A package is not used where only modules of it are named.
            if not all(name.removeprefix("fibrefit.") in MODULES for name in names):
                yield base
            yield from names


def _statements(tree: ast.AST, in_functions: bool, for_types: bool) -> Iterator[ast.AST]:
    for node in ast.iter_child_nodes(tree):
        if not in_functions and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if not for_types and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        yield from _statements(node, in_functions, for_types)


def own_imports(module: str, *, at_import_only: bool = False) -> set[str]:
    """Modules of ours that `module` imports, by their name below the root."""
    found = set()
    for name in imports(module, at_import_only=at_import_only):
        if name == "fibrefit" or name.startswith("fibrefit."):
            below = name.removeprefix("fibrefit").removeprefix(".")
            if below in MODULES:
                found.add(below)
    return found


@pytest.mark.parametrize("modules", by_floor(set(MODULES) - ABOVE))
def test_imports_point_downwards(modules: list[str]) -> None:
    for module in modules:
        here = module.split(".")[0]
        assert here in FLOORS, f"{module}: give the package {here!r} a floor"
        for other in own_imports(module) - {""}:
            there = other.split(".")[0]
            assert there == here or FLOORS[there] < FLOORS[here], f"{module} imports {other}: not on a lower floor"


@pytest.mark.parametrize("modules", by_floor(set(MODULES) - ABOVE))
def test_nothing_inside_imports_the_root(modules: list[str]) -> None:
    for module in modules:
        names = {node.module for node in ast.walk(MODULES[module]) if isinstance(node, ast.ImportFrom)}
        plain = {a.name for node in ast.walk(MODULES[module]) if isinstance(node, ast.Import) for a in node.names}
        assert "fibrefit" not in names | plain, f"{module} imports the package root"


#: Packages of which others use the names of `__init__` alone.
FACES = ("problem",)


def behind_faces(module: str) -> set[str]:
    """Modules behind the face of another package that a module imports from."""
    return {
        other
        for other in own_imports(module)
        if "." in other and other.split(".")[0] in set(FACES) - {module.split(".")[0]}
    }


@pytest.mark.parametrize("modules", by_floor(MODULES))
def test_a_package_with_a_face_is_used_by_it(modules: list[str]) -> None:
    for module in modules:
        found = behind_faces(module)
        assert not found, f"{module} imports from {', '.join(sorted(found))}: take it from the face of the package"


def test_who_goes_behind_a_face_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    source = "from fibrefit.problem import Task\ndef f():\n    from fibrefit.problem.task import Task"
    monkeypatch.setitem(MODULES, "fitting.result", ast.parse(source))
    assert behind_faces("fitting.result") == {"problem.task"}


def test_no_import_cycle() -> None:
    graph = {module: own_imports(module, at_import_only=True) - {module} for module in MODULES}
    for start in graph:
        seen: set[str] = set()
        todo = set(graph[start])
        while todo:
            current = todo.pop()
            seen.add(current)
            todo |= graph[current] - seen
        assert start not in seen, f"{start} reaches itself through its imports"


#: A text that names code, and is no sentence of a person's, is no longer.
LONGEST_REFERENCE = 60

ROOMS = sorted({name.rpartition(".")[0] for name in MODULES} - ABOVE)


def room_of(module: str) -> str:
    """``problem.noise.coloured`` lies in ``problem.noise``; a module beside the rooms is a room of its own."""
    return ".".join(module.split(".")[:2])


def test_rooms_of_a_package_do_not_lean_on_each_other() -> None:
    arrows = {(room_of(a), room_of(b)) for a in MODULES for b in own_imports(a) if a.split(".")[0] == b.split(".")[0]}
    rooms = {room for room in ROOMS if "." in room}
    mutual = {pair for pair in arrows if pair[::-1] in arrows and pair[0] != pair[1] and rooms & set(pair)}
    assert not {pair for pair in mutual if all("." in name for name in pair)}, sorted(mutual)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_is_seen_at_a_glance(room: str) -> None:
    files = list((PACKAGE / room.replace(".", "/")).glob("*.py"))
    assert len(files) <= MOST_FILES or room in ONE_FILE_A_THING, f"{room} has {len(files)} files"


@pytest.mark.parametrize("modules", by_floor(set(MODULES) - ABOVE))
def test_each_outside_package_has_its_importers(modules: list[str]) -> None:
    for module in modules:
        for name in imports(module, for_types=False):
            owners = SOLE_IMPORTERS.get(name.split(".")[0])
            allowed = owners is None or any(module == owner or module.startswith(f"{owner}.") for owner in owners)
            assert allowed, f"{module} imports {name}: only {', '.join(sorted(owners or ()))} may"


@pytest.mark.parametrize("modules", by_floor([m for m in MODULES if m.split(".")[0] in WITHOUT_JAX]))
def test_floors_without_jax(modules: list[str]) -> None:
    for module in modules:
        outside = {name.split(".")[0] for name in imports(module)}
        # The doctor looks at the devices JAX finds: that is its purpose.
        if module != "cli.doctor":
            assert not outside & {"jax", "equinox", "optimistix"}, f"{module} imports JAX"


@pytest.mark.parametrize("modules", by_floor(MODULES))
def test_size(modules: list[str]) -> None:
    for module in modules:
        tree = MODULES[module]
        last = max((node.end_lineno or 0 for node in ast.walk(tree) if isinstance(node, ast.stmt)), default=0)
        assert last <= LONGEST_FILE, f"{module} has {last} lines"
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                length = (node.end_lineno or 0) - node.lineno + 1
                if f"{module}.{node.name}" in public_entry_points():
                    # What users call is explained at length; only its code counts.
                    length -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
                assert length <= LONGEST_FUNCTION, f"{module}.{node.name} has {length} lines"


def test_no_package_grows() -> None:
    found = Budget.of(BUDGET.read_text(encoding="utf-8")).exceeded(counts(PACKAGE.parent))
    assert not found, f"{found}: make it smaller, or say what it bought (python -m tests.count --help)"


def test_a_budget_that_rises_says_what_it_bought() -> None:
    """Against the budget of the last commit that had another one."""
    call = ["git", "log", "-2", "--format=%H", "--", str(BUDGET)]
    root, now = PACKAGE.parent, BUDGET.read_text(encoding="utf-8")
    if not (root / ".git").exists():
        pytest.skip("not a checkout")
    for commit in subprocess.run(call, cwd=root, capture_output=True, text=True, check=True).stdout.split():
        show = ["git", "show", f"{commit}:{BUDGET.relative_to(root).as_posix()}"]
        before = subprocess.run(show, cwd=root, capture_output=True, text=True, check=True).stdout
        if before != now:
            assert not Budget.of(now).unexplained(Budget.of(before))
            return


def test_growth_is_seen_and_has_to_be_explained() -> None:
    before = Budget({"core": {"files": 2, "code": 50, "single": 3, "numbers": 4}}, [])
    assert not before.exceeded({"core": Count(2, 900, 50, 9, 3, 9, 4)})
    assert before.exceeded({"core": Count(2, 90, 51, 9, 3, 9, 4)}) == ["core: code 51, budget 50"]
    assert len(before.exceeded({"another": Count(1, 9, 5, 1, 1, 1, 1)})) == 4
    more = before._replace(packages={"core": before.packages["core"] | {"code": 51}})
    assert more.unexplained(before) == ["core: code from 50 to 51"]
    reason = {"package": "core", "quantity": "code", "to": 51, "bought": "reads another unit"}
    assert not more._replace(raised=[reason]).unexplained(before)
    assert more._replace(raised=[reason | {"bought": " "}]).unexplained(before)
    assert more._replace(raised=[reason]).unexplained(before._replace(raised=[reason]))


@pytest.mark.parametrize("modules", by_floor(set(MODULES) - {"core.declarations"}))
def test_units_of_channels_stand_in_one_table(modules: list[str]) -> None:
    for module in modules:
        for node in ast.walk(MODULES[module]):
            if isinstance(node, ast.Dict):
                pairs = [
                    (ast.unparse(key), ast.unparse(value))
                    for key, value in zip(node.keys, node.values, strict=True)
                    if key
                ]
                twice = {("'force'", "'N'"), ("'position'", "'m'"), ("'angle'", "'rad'")} & set(pairs)
                assert not twice, f"{module} line {node.lineno} declares units of channels: take core.declarations"


@pytest.mark.parametrize("modules", by_floor([m for m in MODULES if m.split(".")[0] != "cli"]))
def test_library_never_prints(modules: list[str]) -> None:
    for module in modules:
        calls = {
            n.func.id for n in ast.walk(MODULES[module]) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
        }
        assert "print" not in calls


#: Floors that return numbers and identifiers; `report` puts them into words.
NUMERICAL = ("simulation", "problem", "fitting", "sampling", "discovery", "series")

#: A law that was composed is a Python file: its numbers are part of the code.
WRITES_CODE = {"discovery.laws.source"}


def formatted_numbers(tree: ast.Module) -> set[str]:
    """Numbers that are formatted for a person, but for those of errors."""
    errors = [node for node in ast.walk(tree) if isinstance(node, ast.Raise)]
    errors += [
        node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Error")
    ]
    inside = {id(node) for error in errors for node in ast.walk(error)}
    return {
        ast.unparse(node)
        for node in ast.walk(tree)
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None and id(node) not in inside
    }


@pytest.mark.parametrize("modules", by_floor([m for m in set(MODULES) - WRITES_CODE if m.split(".")[0] in NUMERICAL]))
def test_numerical_floors_make_no_sentences(modules: list[str]) -> None:
    for module in modules:
        assert not formatted_numbers(MODULES[module]), f"{module}: return the number, say it in report"


def test_a_number_in_a_sentence_is_seen() -> None:
    source = "def f(x):\n    if x > 1.0:\n        raise ValueError(f'{x:g} is too large')\n    return f'it is {x:.3g}'"
    assert len(formatted_numbers(ast.parse(source))) == 1


def _assigned(tree: ast.Module) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Targets and values of a module's own assignments, one by one where several are made at once."""
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            yield node.target, node.value
        for target in node.targets if isinstance(node, ast.Assign) else ():
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                yield from zip(target.elts, node.value.elts, strict=True)
            else:
                yield target, node.value


def _is_number(value: ast.expr) -> bool:
    """Whether a constant is a number, or made of numbers alone."""
    inside = [node for node in ast.walk(value) if not isinstance(node, ast.operator | ast.unaryop)]
    numbers = [node for node in inside if isinstance(node, ast.Constant) and isinstance(node.value, int | float)]
    made = [node for node in inside if isinstance(node, ast.BinOp | ast.UnaryOp)]
    return len(numbers) + len(made) == len(inside)


#: Identities are no thresholds: a mode, a kind of chunk, a version of a layout.
IDENTITY = (ast.Eq, ast.NotEq, ast.In, ast.NotIn, ast.Is, ast.IsNot)

#: Numbers of formulas: none, all, half, twice.
PLAIN = {0.0, 0.5, 1.0, 2.0}


def _defaults(function: ast.FunctionDef, constants: set[str]) -> Iterator[str]:
    """Numbers that an argument has unless it is given, and that it is compared by in the function."""
    told = function.args
    places = [*told.posonlyargs, *told.args]
    given = [
        *zip(reversed(places), reversed(told.defaults), strict=False),
        *zip(told.kwonlyargs, told.kw_defaults, strict=True),
    ]
    compared = {
        n.id for c in ast.walk(function) if isinstance(c, ast.Compare) for n in ast.walk(c) if isinstance(n, ast.Name)
    }
    for argument, value in given:
        if argument.arg in compared:
            if isinstance(value, ast.Name) and value.id in constants:
                yield value.id
            elif isinstance(value, ast.Constant) and isinstance(value.value, float) and value.value not in PLAIN:
                yield str(value.value)


def _home_of(module: str, name: str) -> str:
    """Module that a name of a face comes from; any other module itself."""
    for node in MODULES[module].body if module in FACES else ():
        if isinstance(node, ast.ImportFrom) and name in {alias.name for alias in node.names}:
            return (node.module or "").removeprefix("fibrefit.")
    return module


def _borrowed(tree: ast.Module) -> Iterator[str]:
    """Numbers of other modules that are no thresholds."""
    for node in (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)):
        for alias in node.names:
            home = _home_of((node.module or "").removeprefix("fibrefit."), alias.name)
            if home in MODULES and not home.endswith(HOMES):
                found = {t.id for t, value in _assigned(MODULES[home]) if isinstance(t, ast.Name) and _is_number(value)}
                yield from found & {alias.name}


def numbers_compared(tree: ast.Module) -> set[str]:
    """Constants of a module, and numbers with a point, by which something is called larger or smaller."""
    constants = {target.id for target, value in _assigned(tree) if isinstance(target, ast.Name) and _is_number(value)}
    constants |= set(_borrowed(tree))
    found = {
        name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) for name in _defaults(node, constants)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare) and not all(isinstance(how, IDENTITY) for how in node.ops):
            inside = list(ast.walk(node))
            found |= {n.id for n in inside if isinstance(n, ast.Name)} & constants
            plain = {n.value for n in inside if isinstance(n, ast.Constant) and isinstance(n.value, float)}
            found |= {str(value) for value in plain - PLAIN}
    return found


#: What shows results to a person has sizes of its own, each for its page.
PAGES = ("plots", "report", "cli", "store", "tables")

#: Floors without a verdict; what `report` calls small or sure is one.
SHOWS = set(PAGES) - {"report"}


#: Modules that hold numbers for others, each with its reason: thresholds, how far a search looks, what is allowed.
HOMES = ("thresholds", "effort", "core.limits")


def compares(module: str) -> set[str]:
    """Numbers that a module compares with, where it has to say why."""
    exempt = module.split(".")[0] in SHOWS or module.endswith(HOMES)
    return set() if exempt else numbers_compared(MODULES[module])


@pytest.mark.parametrize("modules", by_floor(MODULES))
def test_what_decides_a_verdict_stands_among_the_thresholds(modules: list[str]) -> None:
    for module in modules:
        found = compares(module) - REASONS.get(module, {}).keys()
        assert not found, (
            f"{module} compares with {', '.join(sorted(found))}: put it into the thresholds of its floor, with a "
            "Bracket; what decides nothing that anybody is told gets its reason in tests/tolerances.py"
        )


def test_no_reason_is_given_for_what_is_gone() -> None:
    gone = {f"{module}: {name}" for module, names in REASONS.items() for name in names.keys() - compares(module)}
    assert not gone, gone


def scatters(tree: ast.Module) -> bool:
    """Whether a module adds rows or matrices in places of its own choice, by NumPy's `add.at`."""
    return any(isinstance(node, ast.Attribute) and ast.unparse(node).endswith("add.at") for node in ast.walk(tree))


def test_matrices_of_records_are_assembled_in_one_place() -> None:
    assert [module for module, tree in MODULES.items() if scatters(tree)] == ["core.arrays"]


def homes_of_threshold_names() -> dict[str, list[str]]:
    """Modules that give a value to a name that a threshold bears, whether that module shows it to others or not."""
    homes: dict[str, list[str]] = {}
    for module, tree in MODULES.items():
        for target, _ in _assigned(tree):
            for node in ast.walk(target):
                if isinstance(node, ast.Name):
                    homes.setdefault(node.id, []).append(module)
    return {name: where for name, where in homes.items() if any(m.endswith(("thresholds", "effort")) for m in where)}


def test_a_threshold_has_a_name_of_its_own() -> None:
    named = homes_of_threshold_names()
    twice = {name: homes for name, homes in named.items() if len(homes) > 1}
    assert named, "no thresholds were found"
    assert not twice, twice


def test_the_name_of_a_threshold_is_seen_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    name = next(iter(homes_of_threshold_names()))
    monkeypatch.setitem(MODULES, "core.errors", ast.parse(f"WIDTH, {name} = 3, 4"))
    with pytest.raises(AssertionError, match=name):
        test_a_threshold_has_a_name_of_its_own()


def shared_numbers() -> dict[str, list[str]]:
    """Names of numbers that a module reads from another one, and the modules that give a number to such a name."""
    floors = {module: tree for module, tree in MODULES.items() if module.split(".")[0] not in PAGES}
    read = {name for module in floors for name in imports(module)}
    homes: dict[str, list[str]] = {}
    for module, tree in floors.items():
        for target, value in _assigned(tree):
            if isinstance(target, ast.Name) and target.id.isupper() and _is_number(value):
                homes.setdefault(target.id, []).append(module)
    return {name: where for name, where in homes.items() if read & {f"fibrefit.{module}.{name}" for module in where}}


def test_a_number_that_is_read_elsewhere_has_a_name_of_its_own() -> None:
    twice = {name: homes for name, homes in shared_numbers().items() if len(homes) > 1}
    assert not twice, twice


def test_the_name_of_a_shared_number_is_seen_anywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    name = next(iter(shared_numbers()))
    monkeypatch.setitem(MODULES, "core.errors", ast.parse(f"WIDTH, {name} = 3, 4"))
    with pytest.raises(AssertionError, match=name):
        test_a_number_that_is_read_elsewhere_has_a_name_of_its_own()


def test_a_number_in_a_verdict_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    tree = ast.parse("LIMIT = 0.3\nKIND = 4\ndef f(x, k):\n    return 2 * LIMIT > x > 0.7 * k and k == KIND")
    monkeypatch.setitem(MODULES, "core.errors", tree)
    borrows = ast.parse("from fibrefit.core.errors import LIMIT\ndef g(x):\n    return x > LIMIT")
    monkeypatch.setitem(MODULES, "core.paths", borrows)
    assert (compares("core.errors"), compares("core.paths")) == ({"LIMIT", "0.7"}, {"LIMIT"})
    with pytest.raises(AssertionError, match="LIMIT"):
        test_what_decides_a_verdict_stands_among_the_thresholds(["core.paths"])


def test_so_is_one_of_several_and_one_that_is_computed() -> None:
    source = "LOW, HIGH = 0.3, 3\nMOST: float = 2.0 / 3.0\nWORD = 'x'\n"
    source += "def f(x):\n    return Check(x < LOW, x > HIGH > MOST > WORD)\n"
    source += "def g(x, by=SHARE, *, to=0.9, of=0.8):\n    return of if by < x < to else 1.0\n"
    assert numbers_compared(ast.parse(f"SHARE = 0.4\n{source}")) == {"LOW", "HIGH", "MOST", "SHARE", "0.9"}


def arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """Names of all arguments but the object a method is called on."""
    told = node.args
    return [arg.arg for arg in (*told.posonlyargs, *told.args, *told.kwonlyargs) if arg.arg not in ("self", "cls")]


@cache
def public_entry_points() -> set[str]:
    """Functions a user calls from the root: they may ask for more, by keyword."""
    homes = next(
        node.value
        for node in MODULES[""].body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_HOMES"
    )
    return {home.removeprefix("fibrefit.").replace(":", ".") for home in ast.literal_eval(homes).values()}


@pytest.mark.parametrize("modules", by_floor([m for m in MODULES if m.split(".")[0] != "cli"]))
def test_no_function_asks_for_many_arguments(modules: list[str]) -> None:
    for module in modules:
        for node in ast.walk(MODULES[module]):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                name = f"{module}.{node.name}"
                few = len(arguments(node)) <= MOST_ARGUMENTS
                assert few or name in public_entry_points(), f"{name} has {len(arguments(node))} arguments"


def public_names() -> dict[str, list[str]]:
    """Modules in which each public function or class is defined; the commands of the command line are all called so."""
    homes: dict[str, list[str]] = {}
    for module, tree in MODULES.items():
        for node in tree.body:
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                continue
            if not node.name.startswith("_") and not (node.name == "command" and module.startswith("cli.")):
                homes.setdefault(node.name, []).append(module)
    return homes


@cache
def used_names() -> set[str]:
    """Every name that is read, imported or named by a text anywhere in the package, but for one by itself."""
    found = set()
    for tree in MODULES.values():
        for top in tree.body:
            itself = {top.name} if isinstance(top, ast.FunctionDef | ast.ClassDef) else set()
            said = {id(node.value) for node in ast.walk(top) if isinstance(node, ast.Expr)}
            for node in (node for node in ast.walk(top) if id(node) not in said):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                    found |= {node.id} - itself
                elif isinstance(node, ast.Attribute):
                    found.add(node.attr)
                elif isinstance(node, ast.ImportFrom):
                    found |= {alias.name for alias in node.names}
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    found |= set(re.findall(r"\w+", node.value)) if len(node.value) < LONGEST_REFERENCE else set()
    return found


def unused(module: str, used: set[str]) -> set[str]:
    """Names that a module makes and nothing in the package uses; rules of derivation and rigs are reached otherwise."""
    made = {
        node.id for target, _ in _assigned(MODULES[module]) for node in ast.walk(target) if isinstance(node, ast.Name)
    }
    for node in MODULES[module].body:
        plain = (
            isinstance(node, ast.FunctionDef | ast.ClassDef) and "defjvp" not in ast.unparse(node).partition("def ")[0]
        )
        made |= {node.name} if plain else set()
    declared = {module.rpartition(".")[2].upper()} if module.startswith("rigs.") else set()
    return {name for name in made - used - declared if not name.startswith("__")}


@pytest.mark.parametrize("modules", by_floor([m for m in MODULES if not m.startswith("cli.")]))
def test_what_nothing_uses_is_not_there(modules: list[str]) -> None:
    for module in modules:
        found = unused(module, used_names())
        assert not found, f"{module}: nothing in the package uses {', '.join(sorted(found))}"


#: What a user of the library reads: a method named there is called by people.
TOLD = "\n".join(
    file.read_text(encoding="utf-8")
    for folder, kind in ((".", "*.md"), ("docs", "*.md"), ("notebooks", "*.py"))
    for file in (PACKAGE.parent / folder).glob(kind)
)


def unused_methods(module: str, used: set[str]) -> set[str]:
    """Methods that nothing calls: neither the package, nor its users, nor the library its class derives from."""
    own = {name for homes in MODULES.values() for name in (n.name for n in homes.body if isinstance(n, ast.ClassDef))}
    found = set()
    for node in ast.walk(MODULES[module]):
        if isinstance(node, ast.ClassDef) and all(ast.unparse(base).partition("[")[0] in own for base in node.bases):
            found |= {
                f"{node.name}.{each.name}"
                for each in node.body
                if isinstance(each, ast.FunctionDef) and not each.name.startswith(("__", "_repr_"))
                if each.name not in used and not any("validator" in ast.unparse(one) for one in each.decorator_list)
            }
    return {name for name in found if not re.search(rf"\b{name.partition('.')[2]}\(", TOLD)}


@pytest.mark.parametrize("modules", by_floor(MODULES))
def test_no_method_is_there_that_nothing_calls(modules: list[str]) -> None:
    for module in modules:
        found = unused_methods(module, used_names())
        assert not found, f"{module}: nothing calls {', '.join(sorted(found))}"


def test_a_method_that_nothing_calls_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    source = "class A:\n    def f(self): ...\n    def g(self): ...\nclass B(Thread):\n    def run(self): ..."
    monkeypatch.setitem(MODULES, "core.errors", ast.parse(source))
    assert unused_methods("core.errors", {"f"}) == {"A.g"}


def test_what_nothing_uses_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    source = "LIMIT, WIDTH = 1, 2\ndef f(x):\n    return f(x - 1) + WIDTH\nclass C: ...\ng = C()"
    monkeypatch.setitem(MODULES, "core.errors", ast.parse(source))
    assert unused("core.errors", {"WIDTH", "C"}) == {"LIMIT", "f", "g"}


def test_a_public_name_stands_for_one_thing() -> None:
    twice = {name: homes for name, homes in public_names().items() if len(homes) > 1}
    assert not twice, twice


def test_the_counts_see_what_is_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    source = "class Report: ...\ndef f(self, a, b, *, c, d, e, g, h): ..."
    monkeypatch.setitem(MODULES, "core.errors", ast.parse(source))
    monkeypatch.setitem(MODULES, "core.paths", ast.parse(source))
    assert public_names()["Report"] == ["core.errors", "core.paths"]
    with pytest.raises(AssertionError, match="core.errors.f has 7 arguments"):
        test_no_function_asks_for_many_arguments(["core.errors"])


def test_what_belongs_to_one_machine_is_not_committed() -> None:
    """Such as the environment: a link to one, once committed, takes the place of the real one wherever it is merged."""
    root = PACKAGE.parent
    if not (root / ".git").exists():
        pytest.skip("not a checkout")
    call = ["git", "ls-files", "--cached", "--ignored", "--exclude-standard"]
    kept = subprocess.run(call, cwd=root, capture_output=True, text=True, check=True).stdout.split()
    assert not kept, f"git rm --cached {' '.join(kept)}"


def test_the_reader_of_imports_sees_a_forbidden_one(monkeypatch: pytest.MonkeyPatch) -> None:
    source = "def f():\n    from fibrefit.core import paths\n    import h5py"
    monkeypatch.setitem(MODULES, "core.errors", ast.parse(source))
    assert "core.paths" in own_imports("core.errors")
    assert "h5py" in set(imports("core.errors"))
    assert not set(imports("core.errors", at_import_only=True))
