"""Lists the pip packages that this one needs, and says why one of them does not work."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from importlib.util import find_spec

from sumo3dviz_pt.errors import InstallationError

MENDING = "sumo3dviz-pt doctor --install"
"""The command that brings shared libraries, for messages."""

_MISSING_LIBRARY = re.compile(r"(lib[\w.+-]+?\.so[\w.]*|[\w.+-]+\.dylib)\b")


@dataclass(frozen=True, slots=True)
class Dependency:
    """A package of pip's.

    Attributes:
        package: What pip calls it.
        module: What Python calls it.
    """

    package: str
    module: str


DEPENDENCIES = (
    Dependency("mitsuba", "mitsuba"),
    Dependency("drjit", "drjit"),
    Dependency("mitsuba-oidn", "mitsuba_oidn"),
    Dependency("numpy", "numpy"),
    Dependency("scipy", "scipy"),
    Dependency("trimesh", "trimesh"),
    Dependency("shapely", "shapely"),
    Dependency("mapbox-earcut", "mapbox_earcut"),
    Dependency("OpenEXR", "OpenEXR"),
    Dependency("colour-science", "colour"),
    Dependency("platformdirs", "platformdirs"),
    Dependency("pyyaml", "yaml"),
    Dependency("pydantic", "pydantic"),
    Dependency("imageio-ffmpeg", "imageio_ffmpeg"),
    Dependency("pillow", "PIL"),
    Dependency("tqdm", "tqdm"),
    Dependency("tzfpy", "tzfpy"),
    Dependency("tzdata", "tzdata"),
)
"""All packages that any command may need; what only an extra brings is not among them."""


def version_of(package: str) -> str:
    """Return the installed version, or `missing`; a checkout that is not installed is `source`."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "source" if package == "sumo3dviz_pt" else "missing"


def require_packages() -> None:
    """Refuse to begin work that a missing package would end; nothing is loaded.

    Raises:
        InstallationError: If one is not installed.
    """
    missing = [known.package for known in DEPENDENCIES if find_spec(known.module) is None]
    if missing:
        raise InstallationError(
            f"not installed: {', '.join(missing)}; install with: {_pip_command(missing)}"
        )


def load(*modules: str) -> None:
    """Load packages before work begins that would end without them.

    Raises:
        InstallationError: If one cannot be loaded.
    """
    for module in modules:
        try:
            import_module(module)
        except (ImportError, RuntimeError) as error:
            raise InstallationError(explained(package_of(module), error)) from error


def package_of(module: str | None) -> str:
    """Return what pip calls the package of a module."""
    name = (module or "a package").split(".")[0]
    known = {dependency.module: dependency.package for dependency in DEPENDENCIES}
    return known.get(name, name)


def _pip_command(packages: list[str]) -> str:
    """Return what installs packages beside this one, in the versions that it takes."""
    try:
        ranges = metadata.requires("sumo3dviz_pt") or []
    except metadata.PackageNotFoundError:
        ranges = []
    wanted = {re.split(r"[^\w.-]", text)[0].lower(): text for text in reversed(ranges)}
    texts = [f'"{wanted.get(package.lower(), package)}"' for package in packages]
    return " ".join([_quoted(sys.executable), "-m pip install", *texts])


def _quoted(path: str) -> str:
    """Return a path as a shell takes it."""
    return f'"{path}"' if " " in path else path


def explained(package: str, error: BaseException) -> str:
    """Return why a package cannot be loaded, and the one command that mends it.

    Args:
        package: What pip calls it.
        error: What its import raised. Dr.Jit hides the reason behind a NameError.
    """
    first = [error, *_import_errors(error)][-1]
    reason = next(iter(str(first).splitlines()), type(first).__name__)
    library = missing_library(error)
    if library:
        return f"{package} cannot be loaded: {library} is missing; install it with: {MENDING}"
    again = f"{_quoted(sys.executable)} -m pip install --force-reinstall {package}"
    return f"{package} cannot be loaded: {reason}; install it anew with: {again}"


def missing_library(error: BaseException) -> str:
    """Return the shared library that is missing by an error, such as `libatomic.so.1`, or ''."""
    for cause in _import_errors(error):
        found = _MISSING_LIBRARY.search(str(cause))
        if found and ("cannot open shared object" in str(cause) or "not loaded" in str(cause)):
            return found.group(1)
    return ""


def _import_errors(error: BaseException | None) -> Iterator[ImportError]:
    """Yield the failed imports behind an error, the first cause last."""
    while error is not None:
        if isinstance(error, ImportError):
            yield error
        error = error.__cause__ or error.__context__
