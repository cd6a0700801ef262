"""Compiled programs: taken up again without tracing, bounded in number, the same bits with any number of threads.

JAX keeps what its compiler made, but traces and lowers a function in every process before it looks there; for a fit
that took four times as long as the fit itself. Here the key of a program is made from what goes into it: the code of
this package, the structure and all fixed parts of the arguments, shapes and types of the arrays, versions and
processor. A program that is not there, or whose arguments hold something that has no stable description, such as a law
from a file of the user's own, is traced as ever.

Files of programs are as trustworthy as the folder they lie in, which is the user's own: they hold native code.
"""

from __future__ import annotations

import ctypes
import dataclasses
import enum
import functools
import gc
import hashlib
import importlib
import json
import os
import pickle
import platform
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from types import BuiltinFunctionType, FunctionType, MethodType
from typing import Any, Generic, NamedTuple, TypeVar
from weakref import WeakSet

import equinox as eqx
import jax
import jax.monitoring
import jax.numpy as jnp
import numpy as np

from fibrefit.core.environment import own_folder, versions
from fibrefit.core.threads import UNWAITED

R = TypeVar("R")

MOST_IN_MEMORY = 128
"""Programs of one function that a process keeps at hand."""
MOST_ON_DISK = 1500
"""Programs in the cache folder, of 0.3 MB each: those of some fifteen searches; beyond, those unused for longest go."""
SUFFIX = ".program"
SETTLED_SECONDS = 3600.0
"""Time after which code that has not changed is taken to be in use."""

Program = Callable[[Sequence[Any]], Any]
MOST_PROGRAMS = 100
"""Programs kept: several studies' worth of fits, or one search's. Each takes some 10 MB; one that is wanted again comes
from the disk cache."""


class Call(NamedTuple):
    """Arguments of a call but for the values of its arrays.

    Parameters
    ----------
    fixed : list
        Leaves of the arguments; None in the place of each array.
    tree : PyTreeDef
    places : list of int
        Of the arrays among the leaves.
    shapes : tuple
        Shape, type and weakness of the type of each array.
    """

    fixed: list[Any]
    tree: Any
    places: list[int]
    shapes: tuple[Any, ...]

    def with_(self, arrays: Sequence[Any]) -> Any:
        """The arguments with other arrays."""
        leaves = list(self.fixed)
        for place, array in zip(self.places, arrays, strict=True):
            leaves[place] = array
        return jax.tree.unflatten(self.tree, leaves)


def partitioned(args: tuple[Any, ...]) -> tuple[Call, list[Any]]:
    """A call with such arguments, and its arrays."""
    leaves, tree = jax.tree.flatten(args)
    places = [i for i, leaf in enumerate(leaves) if eqx.is_array(leaf)]
    arrays = [leaves[i] for i in places]
    fixed = [None if eqx.is_array(leaf) else leaf for leaf in leaves]
    shapes = tuple((array.shape, array.dtype, getattr(array, "weak_type", False)) for array in arrays)
    return Call(fixed, tree, places, shapes), arrays


class KeptProgram(Generic[R]):
    """A pure function of pytrees whose arrays vary and whose other parts are fixed, compiled and kept.

    Parameters
    ----------
    function : callable
        Of positional arguments; it returns arrays in tuples, lists and dicts.
    """

    def __init__(self, function: Callable[..., R]) -> None:
        functools.update_wrapper(self, function)
        self._function = function
        self._traced = eqx.filter_jit(function)
        self._programs: OrderedDict[Any, Program] = OrderedDict()
        self._lock = threading.Lock()
        self._making: dict[Any, threading.Lock] = {}
        _INSTANCES.add(self)

    def __get__(self, instance: Any, owner: type) -> Any:
        return self if instance is None else MethodType(self, instance)

    def __call__(self, *args: Any, **kwargs: Any) -> R:
        """As the function."""
        call, arrays = partitioned(args)
        if kwargs or any(isinstance(array, jax.core.Tracer) for array in arrays) or _setting("disable_jit"):
            return self._traced(*args, **kwargs)
        found: R = self._program_of(call, arrays)(arrays)
        return found

    def make(self, *args: Any) -> None:
        """Make the program of a call, or take it up, without carrying it out: what arrays hold does not matter."""
        self._program_of(*partitioned(args))

    def _program_of(self, call: Call, arrays: list[Any]) -> Program:
        """The program of a call; one thread makes it, while others make others: compilers run side by side."""
        key = (call.tree, tuple(call.fixed), tuple(call.places), call.shapes)
        if program := self._programs.get(key):
            return program
        with self._lock:
            mine = self._making.setdefault(key, threading.Lock())
        with mine:
            program = self._programs.get(key) or self._found(call, arrays)
            with self._lock:
                self._programs[key] = program
                self._making.pop(key, None)
                while len(self._programs) > MOST_IN_MEMORY:
                    self._programs.popitem(last=False)
        return program

    def _found(self, call: Call, arrays: list[Any]) -> Program:
        """The program of a call from its file, or compiled."""
        folder = programs_folder()
        if folder is None:
            return self._compiled(call, arrays, None)
        try:
            said = fingerprint((self._function, call.with_(["array"] * len(call.places)), call.shapes))
        except NotDescribedError:
            return self._compiled(call, arrays, None)
        file = folder / f"{hashlib.sha256(f'{_surroundings()}{said}'.encode()).hexdigest()}{SUFFIX}"
        program = _loaded(file)
        if program is None:
            return self._compiled(call, arrays, file)
        run, proven = program, False

        def watched(arrays: Sequence[Any]) -> Any:
            """One that was damaged may fail only when it runs: the first time it is watched."""
            nonlocal run, proven
            if proven:
                return run(arrays)
            try:
                found = jax.block_until_ready(run(arrays))
            except Exception:  # whatever is wrong with it, the function can be traced
                file.unlink(missing_ok=True)
                run = self._compiled(call, list(arrays), file)
                found = run(arrays)
            proven = True
            return found

        return watched

    def _compiled(self, call: Call, arrays: list[Any], file: Path | None) -> Program:
        """The program of a call, compiled, and kept if it was compiled just now: what JAX kept itself cannot be.

        One that JAX has although the code has changed around it is compiled anew once that code has been in use for a
        while: not after each change by somebody who works on it.
        """
        structure: list[Any] = []

        def flat(*values: Any) -> list[Any]:
            leaves, tree = jax.tree.flatten(self._function(*call.with_(values)))
            structure[:] = [jax.tree.unflatten(tree, range(len(leaves)))]
            return leaves

        flat.__name__ = self._function.__name__
        lowered = jax.jit(flat).lower(*arrays)
        if file is None:
            return _program(lowered.compile(), structure[0])
        seen = file.with_suffix(".seen")
        if seen.exists() and time.time() - seen.stat().st_mtime > SETTLED_SECONDS:
            with _without_cache():
                compiled = lowered.compile()
            seen.unlink(missing_ok=True)
            fresh = True
        else:
            before = _HITS.number
            compiled = lowered.compile()
            fresh = _HITS.number == before
            if not fresh and not seen.exists():
                seen.touch()
        if fresh:
            _save(file, compiled, structure[0])
        return _program(compiled, structure[0])


_INSTANCES: WeakSet[KeptProgram[Any]] = WeakSet()


def kept_program(function: Callable[..., R]) -> KeptProgram[R]:
    """Decorate a function to be compiled once for all processes; see `KeptProgram`."""
    return KeptProgram(function)


def programs_folder() -> Path | None:
    """Folder of the programs; None where nothing is to be kept, or none is our own."""
    if not os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        return None
    return own_folder("programs")


PACKAGE = Path(__file__).resolve().parents[1]

COMPILED = ("core", "laws", "rigs", "simulation", "problem", "fitting", "sampling", "discovery", "series")
"""Packages whose code goes into programs."""

FAMILIAR = ("fibrefit", "builtins", "functools", "operator", "math", "numpy", "jax", "equinox", "optimistix", "lineax")
"""Where classes and functions may come from: their code is in the key, as source or as a version."""

DEEPEST = 60


class NotDescribedError(Exception):
    """A value has no description that means the same in another process."""


def source_digest() -> str:
    """SHA-256 of all code of this package that goes into programs."""
    digest = hashlib.sha256()
    for file in sorted(file for folder in COMPILED for file in (PACKAGE / folder).rglob("*.py")):
        digest.update(file.relative_to(PACKAGE).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def fingerprint(value: Any, depth: int = 0) -> str:
    """Text that two values share only if a program made for one does for the other.

    Parameters
    ----------
    value : object
        Numbers, text, arrays of NumPy, containers, data classes, classes and functions of known packages.
    depth : int
        In how many others it lies.

    Raises
    ------
    NotDescribedError
        If it holds anything else.
    """
    if depth > DEEPEST:
        raise NotDescribedError("nested too deeply")
    if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, type):
        # A class made by a function is what it is made of.
        made = value.__dict__.get("_made_of")
        return _named(value) if made is None else f"class {value.__qualname__}({fingerprint(made, depth + 1)})"
    if isinstance(value, FunctionType):
        # A function is its place in the source and all that it closes over.
        module, code = value.__module__ or "", value.__code__
        where = f"{module}:{value.__qualname__}"
        if module.partition(".")[0] not in FAMILIAR:
            raise NotDescribedError(where)
        where += f":{code.co_firstlineno}:{hashlib.sha256(code.co_code).hexdigest()[:16]}"
        try:
            closed = [cell.cell_contents for cell in value.__closure__ or ()]
        except ValueError:
            raise NotDescribedError(where) from None
        return f"{where}({_describe_all([closed, value.__defaults__, value.__kwdefaults__], depth + 1)})"
    for kinds, say in _KINDS:
        if isinstance(value, kinds):
            return say(value, depth + 1)
    if dataclasses.is_dataclass(value):
        # What takes no part in a comparison takes none in a program.
        fields = [(field.name, getattr(value, field.name)) for field in dataclasses.fields(value) if field.compare]
        return f"{_named(type(value))}({_describe_all(fields, depth + 1)})"
    raise NotDescribedError(f"{type(value).__module__}.{type(value).__qualname__}")


def _describe_all(values: Any, depth: int) -> str:
    return ", ".join(fingerprint(value, depth) for value in values)


def _name(thing: Any) -> str:
    """Module and name of a class or function that is found there again."""
    module, path = thing.__module__ or "", thing.__qualname__
    if module.partition(".")[0] not in FAMILIAR or _at(module, path) is not thing:
        raise NotDescribedError(f"{module}:{path}")
    return f"{module}:{path}"


_named: Callable[[Any], str] = functools.cache(_name)


def _at(module: str, path: str) -> Any:
    try:
        found: Any = importlib.import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError):
        raise NotDescribedError(f"{module}:{path}") from None
    return found


def _array(value: np.ndarray, depth: int) -> str:
    if value.dtype.hasobject:
        return f"objects {value.shape} ({_describe_all(value.ravel().tolist(), depth)})"
    return f"{value.dtype} {value.shape} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"


_KINDS: tuple[tuple[Any, Any], ...] = (
    (tuple, lambda value, depth: f"{_named(type(value))}({_describe_all(value, depth)})"),
    (list, lambda value, depth: f"[{_describe_all(value, depth)}]"),
    (Mapping, lambda value, depth: f"{{{_describe_all(value.items(), depth)}}}"),
    ((set, frozenset), lambda value, depth: f"set({sorted(fingerprint(part, depth) for part in value)})"),
    (enum.Enum, lambda value, depth: f"{_named(type(value))}.{value.name}"),
    (np.ndarray, _array),
    (np.dtype, lambda value, depth: f"dtype {value}"),
    (PurePath, lambda value, depth: f"path {value}"),
    ((slice, range), lambda value, depth: repr(value)),
    (functools.partial, lambda v, depth: f"partial({_describe_all((v.func, v.args, v.keywords), depth)})"),
    (MethodType, lambda v, depth: f"method({_describe_all((v.__func__, v.__self__), depth)})"),
    (BuiltinFunctionType, lambda value, depth: _named(value)),
)


@functools.cache
def _surroundings() -> str:
    """All that a program depends on besides its function and arguments."""
    device = jax.devices()[0]
    try:  # programs hold native code, of the instructions that the processor knows
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        instructions = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        instructions = platform.processor()
    content = {
        "versions": versions(),
        "source": source_digest(),
        "device": f"{device.platform} {device.device_kind} {len(jax.devices())} {device.client.platform_version}",
        "processor": f"{platform.machine()} {instructions}",
        "flags": os.environ.get("XLA_FLAGS", ""),
        "settings": f"{_setting('enable_x64')} {_setting('debug_nans')} {sys.byteorder}",
    }
    return json.dumps(content, sort_keys=True)


def _setting(name: str) -> Any:
    return getattr(jax.config, f"jax_{name}")


def _program(compiled: Any, skeleton: Any) -> Program:
    order, tree = jax.tree.flatten(skeleton)

    def run(arrays: Sequence[Any]) -> Any:
        leaves = compiled(*arrays)
        return jax.tree.unflatten(tree, [leaves[i] for i in order])

    return run


_SETTING = threading.RLock()
"""Held while a setting of JAX, which all threads see, is another one."""


@contextmanager
def _without_cache() -> Iterator[None]:
    from jax.experimental.compilation_cache import compilation_cache

    with _SETTING:
        jax.config.update("jax_enable_compilation_cache", False)
        compilation_cache.reset_cache()
        try:
            yield
        finally:
            jax.config.update("jax_enable_compilation_cache", True)
            compilation_cache.reset_cache()


class _Hits(threading.local):
    """How often JAX found a program of this thread in its own cache."""

    number = 0


_HITS = _Hits()


def _on_event(event: str, **_: Any) -> None:
    _HITS.number += event == "/jax/compilation_cache/cache_hits"


jax.monitoring.register_event_listener(_on_event)


def _loaded(file: Path) -> Program | None:
    """A program from its file; None where there is none, or none that can be used."""
    from jax.experimental.serialize_executable import deserialize_and_load

    try:
        *program, skeleton = pickle.loads(file.read_bytes())
        _bind_lapack()
        compiled = deserialize_and_load(*program)
        os.utime(file)
    except FileNotFoundError:
        return None
    except Exception:  # whatever is wrong with it, the function can be traced
        file.unlink(missing_ok=True)
        return None
    return _program(compiled, skeleton)


@functools.cache
def _bind_lapack() -> None:
    """JAX looks up the routines of LAPACK when it first lowers one; a program that is only loaded would find none.

    To lower one takes a third of a second, and asking jaxlib nothing; but its names are not promised to stay.
    """
    try:
        from jaxlib.lapack import prepare_lapack_call

        prepare_lapack_call("potrf_ffi", np.dtype(float))
    except (ImportError, AttributeError, TypeError):
        jax.jit(jax.lax.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), float))


def _save(file: Path, compiled: Any, skeleton: Any) -> None:
    """Keep a program, if it is one of those that can be kept."""
    from jax.experimental.serialize_executable import serialize

    try:
        content = pickle.dumps((*serialize(compiled), skeleton))
    except (pickle.PicklingError, AttributeError, NotImplementedError, ValueError, TypeError):
        return
    temporary = file.with_suffix(f".{os.getpid()}.{threading.get_ident()}")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, file)
        _trim(file.parent)
    except OSError:
        temporary.unlink(missing_ok=True)


def _trim(folder: Path) -> None:
    """Keep the folder from growing without end."""
    files = [*folder.glob(f"*{SUFFIX}"), *folder.glob("*.seen")]
    if len(files) > MOST_ON_DISK:
        for old in sorted(files, key=lambda path: path.stat().st_mtime)[: len(files) - MOST_ON_DISK]:
            old.unlink(missing_ok=True)


def bound_programs() -> bool:
    """Forget all compiled programs if there are more than `MOST_PROGRAMS`; to be called between two pieces of work.

    JAX keeps every program for every shape it has met until the process ends.

    Returns
    -------
    bool
        Whether they were forgotten.
    """
    from jax.extend.backend import get_backend

    if len(get_backend().live_executables()) <= MOST_PROGRAMS:
        return False
    jax.clear_caches()
    for program in list(_INSTANCES):
        with program._lock:
            program._programs.clear()
    gc.collect()
    # What is free goes back to the system: the allocator of the GNU library would keep nearly all of it.
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)
    return True


_LONGEST = dict.fromkeys(
    (
        "/jax/core/compile/jaxpr_trace_duration",
        "/jax/core/compile/jaxpr_to_mlir_module_duration",
        "/jax/core/compile/backend_compile_duration",
    ),
    0.0,
)
"""Longest of each stage in s, under the names by which JAX tells of them."""
_TOTAL = dict.fromkeys(list(_LONGEST)[1:], 0.0)
"""Sum over all programs in s, of the stages that tell of no part of a program twice: traces lie within others."""


def longest_compilation() -> float:
    """Time in s that the largest program so far took to make: traced, lowered, compiled. 0 where all were at hand."""
    return sum(_LONGEST.values())


def all_compilations() -> float:
    """Time in s that lowering and compiling programs has taken, over all threads but those that nothing waits for."""
    return sum(_TOTAL.values())


def _on_duration(event: str, duration_secs: float, **_: Any) -> None:
    if event in _TOTAL and not UNWAITED.get():
        _TOTAL[event] += duration_secs
    if event in _LONGEST:
        _LONGEST[event] = max(_LONGEST[event], duration_secs)


jax.monitoring.register_event_duration_secs_listener(_on_duration)


BLOCK = 128
"""Samples that are summed in one go. Of 256, a product of 65 rows is shared out among eight threads; of 128, none of up
to 400 rows is."""


def column_products(columns: jax.Array, others: jax.Array) -> jax.Array:
    """Products of each column with each other one, ``(..., n, k)`` and ``(..., n, l)`` to ``(..., k, l)``."""
    return jnp.sum(jnp.einsum("...bnk,...bnl->...bkl", _in_blocks(columns), _in_blocks(others)), axis=-3)


def _in_blocks(columns: jax.Array) -> jax.Array:
    """Columns ``(..., n, k)`` as ``(..., n_block, BLOCK, k)``, padded with zeros."""
    *before, n, k = columns.shape
    padding = [(0, 0)] * len(before) + [(0, -n % BLOCK), (0, 0)]
    return jnp.pad(columns, padding).reshape(*before, -(-n // BLOCK), BLOCK, k)
