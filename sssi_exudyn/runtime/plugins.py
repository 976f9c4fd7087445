"""Plug-ins: other people's code, run only when the user names it.  Files that need a plug-in say which, and no more.

A plug-in is a file of Python, or an installed package with entry points.  ``sssi_exudyn.plugins`` puts its content to
use; this module knows which plug-ins are loaded, and which one a class comes from.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line

GROUPS: Final = ("sssi_exudyn.terms", "sssi_exudyn.hypotheses", "sssi_exudyn.readers")
"""Groups of entry points of installed packages."""
_OWN: Final = "sssi_exudyn"
_PREFIX: Final = "sssi_plugin_"
_HASH: Final = 12
"""Number of letters of a file's hash that end its module's name."""
_MOST: Final = 50
"""Maximum number of plug-ins that a file may need."""


@dataclass(frozen=True)
class Plugin:
    """A plug-in as files record it.

    name : of the file, of the installed package, or of the module in which a class was defined
    digest : hash of the file, version of the package, or hash of the class's code
    source : what loads it: the file's whole path, the package's name; "" for classes of a notebook or a script
    """

    name: str
    digest: str
    source: str = ""

    def as_table(self) -> dict[str, str]:
        """Return what a file records of the plug-in: no path of this machine."""
        return {"name": self.name, "digest": self.digest}


LOADED: dict[str, Plugin] = {}
"""Plug-ins by the modules that were loaded."""
_NEIGHBOURS: Final[dict[str, dict[str, str]]] = {}
"""Modules that a plug-in's file imported from its own folder with their files' hashes, by the plug-in's module."""


def load(what: str | Path) -> list[object]:
    """Run a plug-in's code, once.

    Returns what it offers: the classes and objects of the file, or those of the package's entry points.  A file may
    import modules that stand next to it; installed ones of the same name come first.

    Raises InputError where there is no such file or package, and where its code fails.
    """
    if str(what).endswith(".py"):
        return _load_file(Path(what))
    return _load_package(str(what))


def _load_file(path: Path) -> list[object]:
    try:
        own = hashlib.sha256(path.read_bytes())
    except OSError as error:
        raise InputError(path, "", (error.strerror or str(error)).lower(), "give the plug-in's file") from None
    name = f"{_PREFIX}{path.stem}_{own.hexdigest()[-_HASH:]}"  # another content is another module
    known = _NEIGHBOURS.get(name)
    if known is not None and known != _contents_of(path.parent, known):
        del sys.modules[name]  # a neighbour was changed
    module = sys.modules.get(name)
    if module is None:
        before = _without_other_neighbours(path.parent)
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        sys.path.append(str(path.parent.resolve()))  # at the end: a neighbour replaces no installed module
        try:
            spec.loader.exec_module(module)
        except BaseException as error:
            del sys.modules[name]
            if not isinstance(error, Exception | SystemExit):
                raise
            raise InputError(path, _line_of(error, path), f"{type(error).__name__}: {error}", "correct it") from error
        finally:
            sys.path.remove(str(path.parent.resolve()))
        _NEIGHBOURS[name] = _contents_of(path.parent, set(sys.modules) - before)
    for neighbour, content in sorted(_NEIGHBOURS.get(name, {}).items()):
        own.update(f"{neighbour} {content}".encode())
    plugin = Plugin(path.name, f"sha256:{own.hexdigest()}", str(path.resolve()))
    LOADED.pop(name, None)  # the last one stands last
    LOADED[name] = plugin
    return _offered(module)


def _without_other_neighbours(folder: Path) -> set[str]:
    """Forget the modules next to plug-ins whose names files of ``folder`` have; return the modules that are left."""
    for names in _NEIGHBOURS.values():
        for name in names:
            if (folder / f"{name}.py").exists():
                sys.modules.pop(name, None)
    return set(sys.modules)


def _contents_of(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the hashes of the files of modules that stand in ``folder`` next to a plug-in, by the modules' names."""
    files = {name: folder / f"{name}.py" for name in names if name.isidentifier() and not name.startswith(_PREFIX)}
    return {name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in files.items() if file.is_file()}


def _load_package(name: str) -> list[object]:
    try:
        package = metadata.distribution(name)
    except (metadata.PackageNotFoundError, ValueError):
        fix = "give a file that ends in .py, or the name of an installed package"
        raise InputError(name, "", "no package of this name is installed", fix) from None
    plugin = Plugin(package.name, package.version, package.name)  # my_package and my-package are one
    entries = [entry for entry in package.entry_points if entry.group in GROUPS]
    if not entries:
        raise InputError(name, "", "the package has no entry points for this program", f"declare {', '.join(GROUPS)}")
    offered: list[object] = []
    for entry in entries:
        try:
            offered.append(entry.load())
        except Exception as error:
            raise InputError(
                name, entry.name, f"{type(error).__name__}: {error}", "ask the package's author"
            ) from error
        LOADED[entry.module] = plugin
        defined = getattr(offered[-1], "__module__", None)
        if isinstance(defined, str) and not _is_own(defined):
            LOADED[defined] = plugin
    return offered


def _line_of(error: BaseException, path: Path) -> str:
    """Return the line of the plug-in's file at which it failed, as far as the error shows it."""
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}"
    frame, line = error.__traceback__, 0
    while frame is not None:
        if frame.tb_frame.f_code.co_filename == str(path):
            line = frame.tb_lineno
        frame = frame.tb_next
    return f"line {line}" if line else ""


def _offered(module: ModuleType) -> list[object]:
    """Return what a file defines itself, in order: its classes, and objects of other classes under public names."""
    return [
        value
        for name, value in vars(module).items()
        if not name.startswith("_")
        and not isinstance(value, ModuleType | FunctionType)
        and (not inspect.isclass(value) or value.__module__ == module.__name__)
    ]


def _is_own(module: str) -> bool:
    return module.partition(".")[0] == _OWN


def origin_of(cls: type) -> Plugin | None:
    """Return the plug-in that a class comes from; None for a class of this program."""
    module = cls.__module__
    if _is_own(module):
        return None
    known = LOADED.get(module)
    return known or Plugin(module, _code_hash(cls))


def same_part(one: type, other: type) -> bool:
    """Return whether two classes are one part of a plug-in, perhaps before and after its file was changed."""
    return _home(one) == _home(other) and one.__qualname__ == other.__qualname__


def _home(cls: type) -> str:
    module = cls.__module__
    return module[:-_HASH] if module.startswith(_PREFIX) else module


def origins_of(classes: Iterable[type]) -> tuple[Plugin, ...]:
    """Return the plug-ins of classes, each plug-in once, in the order of their names."""
    plugins = {plugin.name: plugin for plugin in map(origin_of, classes) if plugin is not None}
    return tuple(plugins[name] for name in sorted(plugins))


def _code_hash(cls: type) -> str:
    """Return the sha256 of the code of a class's functions, for a class whose file is unknown."""
    functions = [(name, value) for name, value in vars(cls).items() if isinstance(value, FunctionType)]
    code = "".join(name + _text_of(value.__code__) for name, value in sorted(functions))
    return f"sha256:{hashlib.sha256(code.encode()).hexdigest()}"


def _text_of(code: CodeType) -> str:
    """Return the code of a function as a text that is the same in every process."""
    constants = [_text_of(value) if isinstance(value, CodeType) else repr(value) for value in code.co_consts]
    return f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {constants}"


def tables_of(settings: Mapping[str, Any], path: Path) -> tuple[Plugin, ...]:
    """Read the plug-ins that a file's tables ``[[plugin]]`` name.  Raises InputError for other tables."""
    tables = settings.get("plugin", [])
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables) or len(tables) > _MOST:
        raise InputError(path, "[[plugin]]", "these must be tables", 'write [[plugin]] with name = "…" below')
    plugins = []
    for count, table in enumerate(tables, 1):
        name, digest = table.get("name"), table.get("digest", "")
        if not isinstance(name, str) or not isinstance(digest, str) or not set(table) <= {"name", "digest"}:
            raise InputError(path, f"[[plugin]] {count}", "no name and digest", 'write name = "my_snow.py"')
        plugins.append(Plugin(one_line(name), one_line(digest)))
    return tuple(plugins)


def require(needed: Iterable[Plugin], path: Path) -> None:
    """Raise InputError where a plug-in that the file ``path`` needs is not loaded, or is another than it was."""
    for plugin in needed:
        loaded = [candidate for candidate in LOADED.values() if candidate.name == plugin.name]
        if not loaded:
            problem = f"this needs the plug-in {plugin.name!r}, which is not loaded"
            fix = f"if you trust its code, name it: --plugin {plugin.name}"
            raise InputError(path, "[[plugin]]", problem, fix)
        if plugin.digest and loaded[-1].source and plugin.digest != loaded[-1].digest:
            problem = f"the plug-in {plugin.name!r} is not what it was when this was written"
            raise InputError(path, "[[plugin]]", problem, "take that one, or take away its digest here")


def note(cls: type) -> Plugin:
    """Register a class of a notebook or a script as loaded, so that files that need it can be read in this process."""
    plugin = origin_of(cls)
    if plugin is None:
        raise InputError(cls.__qualname__, "", "this class is the program's own", "define a class of your own")
    return LOADED.setdefault(cls.__module__, plugin)
