"""Running `refine`: read, prepare, evaluate into the output, report; each stage timed."""

from __future__ import annotations

import io
import os
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import fields
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from curvify.backends import Backend
from curvify.cli import files
from curvify.cli.console import Console, size
from curvify.cli.predict import predicted_bytes, predicted_faces
from curvify.cli.trimming import check_trim, load_mask, trimmed_output
from curvify.errors import FormatError, LimitError, MeshError, OptionError
from curvify.formats.dense import dense_output
from curvify.mesh import Marks, PolygonMesh
from curvify.records import field, record
from curvify.refinement import Refinable, refinable
from curvify.schemes import NAMES, load_scheme
from curvify.sinks import DenseLayout, Sink
from curvify.threads import processors
from curvify.words import count_of, listed, marks_of

if TYPE_CHECKING:
    from curvify.cli.report import Recorder
    from curvify.mask import Mask

#: Options that a scheme may have, one or several.
SCHEME_OPTIONS = (
    "cross_tangent",
    "alpha",
    "bulge",
    "normals",
    "sharp_angle",
    "sharp_from",
    "weld",
    "split_rule",
    "chart",
    "blend_order",
    "sharp_model",
    "boundary_corners",
    "kappa",
    "crease_units",
    "depth",
    "max_edge",
    "edge_rule",
    "midpoint_normal",
    "apex",
    "rim",
    "planar",
)


@record
class Request:
    """What the command line asks for; None where the scheme's own default holds."""

    input: str
    output: str
    scheme: str
    level: int
    cross_tangent: str | None
    alpha: float | None
    bulge: float | None
    normals: str | None
    simplify: int | None
    fit: str | None
    marks: str | None
    sharp_angle: float | None
    sharp_from: str | None
    weld: str | None
    split_rule: str | None
    chart: str | None
    blend_order: int | None
    sharp_model: str | None
    boundary_corners: str | None
    kappa: float | None
    crease_units: str | None
    depth: int | None
    max_edge: float | None
    edge_rule: str | None
    midpoint_normal: str | None
    apex: float | None
    rim: bool
    planar: tuple[int, ...]
    trim: str | None
    trim_map: str | None
    trim_mode: str | None
    trim_invert: bool
    input_format: str | None
    output_format: str | None
    triangulate: bool
    weld_normals: bool
    precision: str
    ascii: bool
    no_clobber: bool
    report: str | None
    backend: str
    threads: int | None
    max_faces: int
    dry_run: bool
    quiet: bool
    verbose: bool

    @property
    def scheme_options(self) -> dict[str, Any]:
        """The scheme's options that were given, but for the marks, which stand in a file."""
        given = {name: getattr(self, name) for name in SCHEME_OPTIONS}
        return {name: value for name, value in given.items() if not (value is None or value is False or value == ())}

    @property
    def fit_mode(self) -> str | None:
        """What is fitted where IN is simplified: the fit is made for the surfaces of gregory."""
        if self.simplify is None:
            return None
        return self.fit or ("full" if self.scheme == "gregory" else "none")

    @property
    def source(self) -> str:
        """IN in messages."""
        return files.shown_name(self.input, "stdin")

    @property
    def target(self) -> str:
        """OUT in messages."""
        return files.shown_name(self.output, "stdout")

    def dtype(self, mesh: PolygonMesh) -> np.dtype[Any]:
        """Type of the numbers in OUT."""
        return np.dtype(mesh.position_dtype if self.precision == "input" else self.precision)


@record
class Run:
    """What is known of a run by the time of its report."""

    request: Request
    options: Any
    threads: int
    mesh: PolygonMesh
    surface: Refinable
    dtype: np.dtype[Any]
    format: str
    warnings: list[str]
    seconds: dict[str, float] = field(default_factory=dict)
    bytes: int | None = None
    backend: dict[str, Any] = field(default_factory=dict)
    bytes_sent: int = 0
    traffic: dict[str, Any] = field(default_factory=dict)
    mask: Mask | None = None
    trimmed: tuple[int, int] | None = None

    @property
    def triangulate(self) -> bool:
        """Whether triangles are written: on request, and in formats that have nothing else."""
        return self.request.triangulate or self.format not in files.POLYGON_FORMATS

    @property
    def written(self) -> Refinable:
        """The surface as it is written."""
        return self.surface.weld_normals() if self.request.weld_normals else self.surface

    @property
    def faces(self) -> int:
        """Faces that will be written, or were after trimming."""
        if self.trimmed is not None:
            return self.trimmed[1]
        return predicted_faces(self.surface, self.request.level, self.triangulate, self.request.max_faces)

    @property
    def all_options(self) -> dict[str, Any]:
        """Every option in effect, the scheme's and the output's."""
        request = self.request
        return {
            **plain_options(self.options),
            "marks": request.marks,
            "simplify": request.simplify,
            "fit": request.fit_mode,
            "precision": self.dtype.name,
            "trim": request.trim,
            "trim_map": request.trim and (request.trim_map or "face"),
            "trim_mode": request.trim and (request.trim_mode or "clip"),
            "trim_invert": request.trim_invert,
            "triangulate": self.triangulate,
            "weld_normals": request.weld_normals,
            "ascii": request.ascii,
            "max_faces": request.max_faces,
        }


def refine_file(request: Request) -> Run:
    """Do what the command line asks for; what came of it. Raises CurvifyError."""
    console = Console(request.quiet, request.verbose)
    options, format = check(request)
    seconds: dict[str, float] = {}
    with timed(seconds, "read"):
        mesh = files.read_input(request.input, request.input_format)
    notes: list[str] = []
    if request.simplify is not None:
        with timed(seconds, "simplify"):
            mesh, notes = _simplified(request, mesh, console)
    marks = None if request.marks is None else read_marks(request.marks)
    mask = load_mask(request)
    with timed(seconds, "prepare"), files.naming(request.source, MeshError):
        made = refinable(mesh, request.scheme, **request.scheme_options, marks=marks)
    warnings = [f"{request.source}: {text}" for text in [*notes, *made.warnings]]
    for text in warnings:
        console.warn(text)
    threads = request.threads or processors()
    run = Run(request, options, threads, mesh, made, request.dtype(mesh), format, warnings, seconds, mask=mask)
    _check_limit(run)
    if request.dry_run:
        _tell_prediction(run, console)
    else:
        _refine(run, console)
    return run


def _simplified(request: Request, mesh: PolygonMesh, console: Console) -> tuple[PolygonMesh, list[str]]:
    """The polygons that `simplify` would write for IN as OBJ, and what it would warn of.

    They go through the text of an OBJ file, so that one command gives the bytes of two.
    """
    from curvify.formats import read_mesh, write_stream
    from curvify.simplify import Fit, Options, simplify_and_fit

    given = {name: getattr(request, name) for name in ("weld", "split_rule") if getattr(request, name) is not None}
    options = Options(faces=request.simplify, **given)
    with files.naming(request.source, MeshError), console.progress(request.source) as progress:
        result = simplify_and_fit(mesh, options, Fit(request.fit_mode or "none"), progress.stage)
    text = io.BytesIO()
    write_stream(result.mesh, text, "obj")
    text.seek(0)
    return read_mesh("-", "obj", text), result.warnings


def read_marks(path: str) -> Marks:
    """The marks of a file. Raises FormatError."""
    from curvify.formats.marks_json import read_marks

    return read_marks(path)


def plain_options(options: Any) -> dict[str, Any]:
    """A scheme's options but for the marks, which are no plain value."""
    return {field.name: getattr(options, field.name) for field in fields(options) if field.name != "marks"}


def check(request: Request) -> tuple[Any, str]:
    """The scheme's options and the format of OUT. Raises CurvifyError for what can be seen to fail beforehand."""
    options = scheme_options(request.scheme, request.scheme_options)
    check_trim(request)
    if request.fit is not None and request.simplify is None:
        raise OptionError("--fit is for what --simplify makes; give both, or use curvify fit")
    format = files.check_output(request.output, request.output_format, request.no_clobber)
    files.check_ascii(request.ascii, format)
    files.check_input(request.input, request.input_format)
    if request.report is not None:
        if request.dry_run:
            raise OptionError("--dry-run measures nothing that --report could tell; leave one of them out")
        files.check_report(request.report, {"OUT": request.output, "IN": request.input})
    return options, format


def scheme_options(scheme: str, given: dict[str, Any]) -> Any:
    """The options of a scheme. Raises OptionError, also for one that only other schemes have."""
    kind = load_scheme(scheme).Options
    for name in given:
        if name not in kind.__dataclass_fields__:
            owners = [other for other in NAMES if name in load_scheme(other).Options.__dataclass_fields__]
            schemes = f"the scheme{'s' if len(owners) > 1 else ''} {listed(owners)}"
            raise OptionError(f"{flag(name)} is for {schemes}, not for {scheme}")
    try:
        return kind(**given)
    except OptionError as error:  # the library calls options by their names in Python
        first, blank, rest = str(error).partition(" ")
        raise OptionError(f"{flag(first) if first in given else first}{blank}{rest}") from None


def flag(name: str) -> str:
    """An option as it is typed."""
    return f"--{name.replace('_', '-')}"


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Note how long a stage took."""
    start = time.perf_counter()
    yield
    seconds[stage] = round(time.perf_counter() - start, 6)


def _check_limit(run: Run) -> None:
    """Refuse more faces than allowed, counted as they will be written."""
    request = run.request
    if run.faces > request.max_faces:
        raise LimitError(
            f"{request.source}: {run.surface.amount(request.level)} gives {run.faces:,} faces, more than the limit of "
            f"{request.max_faces:,}; choose less or raise --max-faces"
        )


def _tell_prediction(run: Run, console: Console) -> None:
    request = run.request
    layout = run.written.layout(request.level, run.dtype)
    bytes_ = predicted_bytes(layout, run.format, request.ascii, run.triangulate)
    most = " before trimming" if run.mask is not None else ""
    console.tell(f"{request.source}: {_sizes(run.surface.counts)}")
    console.tell(f"{request.target} would have {_dense_sizes(run, layout)}, about {size(bytes_)}{most}")


def _refine(run: Run, console: Console) -> None:
    request = run.request
    options = ", ".join(f"{name} {value}" for name, value in plain_options(run.options).items())
    console.explain(f"{request.source}: {_sizes(run.surface.counts)}")
    console.explain(f"scheme {request.scheme}, {run.surface.amount(request.level)}, {options}, {run.dtype.name}")
    for source, counts in run.surface.marks.items():
        console.explain(f"{source}: {marks_of(counts)}")
    recorder = _recorder(run)
    with ExitStack() as stack:
        with timed(run.seconds, "open_backend"):
            samples = run.surface.face_count(request.level)
            backend = stack.enter_context(run.surface.open_backend(request.backend, samples))
        run.backend = backend.describe()
        console.explain(f"backend {_backend_name(run.backend)}, {count_of(run.threads, 'thread')}")
        with timed(run.seconds, "evaluate_and_write"):
            layout = _write(run, recorder, console, backend)
        run.bytes_sent, run.traffic = backend.bytes_sent, backend.traffic()
    for text in _traffic_notes(run.traffic):
        console.explain(text)
    console.explain(f"{request.target}: {_dense_sizes(run, layout)}" + (f", {size(run.bytes)}" if run.bytes else ""))
    console.explain_times(run.seconds)
    if request.report is not None and recorder is not None:
        from curvify.cli.report import refine_report, write_report

        write_report(request.report, refine_report(run, layout, recorder))


def _recorder(run: Run) -> Recorder | None:
    """What notes the vertices for the report, where one is asked for."""
    if run.request.report is None:
        return None
    from curvify.cli.report import Recorder

    return Recorder(run.surface)


def _backend_name(backend: dict[str, Any]) -> str:
    """A backend in messages: ``cpu``, ``gpu (device)``."""
    return f"{backend['name']} ({backend['renderer']})" if "renderer" in backend else str(backend["name"])


def _traffic_notes(traffic: dict[str, Any]) -> list[str]:
    """What went to a device and back, and what was left to the CPU, in words."""
    if not traffic:
        return []
    sent = ", ".join(f"{kind} {size(number)}" for kind, number in traffic["sent"].items() if number)
    patches, edges = traffic["patches"], traffic["edges"]
    left = count_of(patches["evaluated_on_cpu"], "patch", "patches"), count_of(edges["evaluated_on_cpu"], "edge")
    return [
        f"sent to the GPU: {sent or 'nothing'}; received {size(traffic['received'])}",
        f"control vectors built on the GPU for {count_of(patches['built_on_gpu'], 'patch', 'patches')}, on the CPU for "
        f"{patches['built_on_cpu']}; evaluated on the CPU: {', '.join(left)}",
    ]


def _write(run: Run, recorder: Recorder | None, console: Console, backend: Backend) -> DenseLayout:
    """Evaluate the surface into OUT."""
    request = run.request
    stdout = files.CountedStdout()
    with (
        files.naming(request.target, FormatError),
        _output(run, stdout.as_file()) as sink,
        console.progress(request.target) as progress,
    ):
        if recorder is not None:
            sink = recorder.into(sink)
        layout = run.written.stream(
            sink,
            request.level,
            run.dtype,
            threads=run.threads,
            max_faces=request.max_faces,
            progress=progress,
            backend=backend,
        )
    if request.output == files.STREAM:
        run.bytes = stdout.count
    elif os.path.isfile(request.output):
        run.bytes = os.path.getsize(request.output)
    return layout


def _output(run: Run, stdout: BinaryIO) -> AbstractContextManager[Sink]:
    """A sink that writes OUT, trimmed where that is asked for."""
    if run.mask is not None:
        return trimmed_output(run, run.mask, stdout)
    request = run.request
    return dense_output(request.output, run.format, ascii=request.ascii, triangulate=run.triangulate, stdout=stdout)


def _sizes(counts: dict[str, int]) -> str:
    return f"{count_of(counts['vertices'], 'vertex', 'vertices')}, {count_of(counts['faces'], 'face')}"


def _dense_sizes(run: Run, layout: DenseLayout) -> str:
    if run.trimmed is not None:
        return f"{count_of(run.trimmed[0], 'vertex', 'vertices')}, {count_of(run.trimmed[1], 'face')} after trimming"
    repeats = f" and {count_of(len(layout.repeats), 'repeat')} of them" if len(layout.repeats) else ""
    return f"{count_of(layout.vertex_count, 'vertex', 'vertices')}{repeats}, {count_of(run.faces, 'face')}"
