"""What a command says while it works: warnings, explanations, a progress bar. All of it goes to standard error."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

from curvify.cli.main import say
from curvify.records import record
from curvify.words import count_of

if TYPE_CHECKING:
    from curvify.findings import Finding

#: Seconds of work before a progress bar appears.
PATIENCE = 0.5


@record
class Console:
    """Speaks as much as the user wants to hear."""

    quiet: bool = False
    verbose: bool = False

    def warn(self, text: str) -> None:
        """A warning."""
        if not self.quiet:
            say(f"curvify: warning: {text}")

    def tell(self, text: str) -> None:
        """What the user asked for."""
        if not self.quiet:
            say(f"curvify: {text}")

    def explain(self, text: str) -> None:
        """What only -v shows."""
        if self.verbose and not self.quiet:
            say(f"curvify: {text}")

    def explain_times(self, seconds: dict[str, float]) -> None:
        """How long each stage took."""
        self.explain(", ".join(f"{stage.replace('_', ' ')} {took:.3f} s" for stage, took in seconds.items()))

    def progress(self, label: str) -> Progress:
        """A progress bar, to be used as a context manager and called with (done, of)."""
        return Progress(label, shown=not self.quiet and sys.stderr.isatty())


class Progress:
    """A progress bar that appears only when the work turns out to be long."""

    def __init__(self, label: str, shown: bool) -> None:
        self.label, self.shown = label, shown
        self.start = time.monotonic()
        self.bar: Any = None

    def __call__(self, done: int, of: int) -> None:
        """``done`` of ``of`` is done."""
        if not self.shown:
            return
        if self.bar is not None:
            self.bar.update(done - self.bar.n)
        elif done < of and time.monotonic() - self.start >= PATIENCE:
            self.bar = self._open(of)
            self.bar.start_t -= time.monotonic() - self.start  # the estimate counts from when the work began
            self.bar.n = done
            self.bar.refresh()

    def stage(self, name: str, share: float) -> None:
        """The ``share`` of all work that is done, and the ``name`` of what is being done now."""
        if self.bar is not None:
            self.bar.set_description_str(f"{self.label}: {name}", refresh=False)
        self(round(1000 * share), 1000)

    def _open(self, of: int) -> Any:
        from tqdm import tqdm

        tqdm.monitor_interval = 0  # no thread of its own
        return tqdm(
            total=of,
            desc=self.label,
            bar_format="{desc} {percentage:3.0f}%|{bar}| {remaining} left",
            delay=1e-6,  # or it would show 0 % first
            smoothing=0,
            leave=False,
            file=sys.stderr,
        )

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self.bar is not None:
            self.bar.close()


def size(number: int) -> str:
    """Bytes in a unit that suits: ``740 bytes``, ``1.2 MB``."""
    if number < 1000:
        return count_of(number, "byte")
    value, units = number / 1000, ["kB", "MB", "GB", "TB"]
    while value >= 999.5 and len(units) > 1:
        value, units = value / 1000, units[1:]
    return f"{value:.3g} {units[0]}"


def as_line(name: str, finding: Finding, condition: str) -> str:
    """``cube.obj: watertight: no: 2 edges of one face only: edge 3-4, 4-7``."""
    if finding.limit:
        condition += f" {finding.limit:,.0f}" if finding.limit >= 1000 else f" {finding.limit:g}"
    answer = "yes" if finding.passed else "no"
    line = ": ".join(part for part in (name, condition, answer, finding.reason) if part)
    if finding.passed or not finding.where:
        return line
    places = ", ".join(f"{place[0]}-{place[1]}" if finding.kind == "edge" else str(place) for place in finding.where)
    more = ", ..." if finding.count > len(finding.where) else ""
    return f"{line}: {finding.kind} {places}{more}"
