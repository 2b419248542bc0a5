"""Where the time of an OpenGL device goes: timer queries around programs, uploads and readback.

Stands between the GPU backend and moderngl, so that it sees whatever the backend does: programs that run, textures and
buffers that are made of data, buffers that are read. Each is finished before the next begins, so that nothing overlaps:
time a whole run without it. Software renderers answer timer queries before they have begun to work: there the clock
counts until all is finished.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from curvify.gpu.device import Device

#: What is told apart.
PARTS = ("kernel", "upload", "readback")


class DeviceTime:
    """Seconds on the ``device``, seconds until it was done (``wall``) and ``bytes`` of each of ``PARTS``."""

    def __init__(self, ctx: Any, queries: bool) -> None:
        self.ctx, self.queries = ctx, queries
        self.active = False
        self.device: Counter[str] = Counter()
        self.wall: Counter[str] = Counter()
        self.bytes: Counter[str] = Counter()

    @contextmanager
    def running(self) -> Iterator[DeviceTime]:
        """Count what is done meanwhile, from zero."""
        for counter in (self.device, self.wall, self.bytes):
            counter.clear()
        self.active = True
        try:
            yield self
        finally:
            self.active = False

    def time(self, part: str, size: int, do: Callable[[], Any]) -> Any:
        """Do something that moves ``size`` bytes."""
        if not self.active:
            return do()
        self.ctx.finish()
        query, begun = self.ctx.query(time=True), time.perf_counter()
        with query:
            result = do()
        self.ctx.finish()
        passed = time.perf_counter() - begun
        self.wall[part] += passed
        self.device[part] += query.elapsed * 1e-9 if self.queries else passed
        self.bytes[part] += size
        return result


class Watched:
    """A moderngl object whose methods named in ``watch`` are timed; all else is its own."""

    def __init__(self, inner: Any, **watch: Callable[..., Any]) -> None:
        self.__dict__.update(inner=inner, watch=watch)

    def __getattr__(self, name: str) -> Any:
        return self.watch.get(name) or getattr(self.inner, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.inner, name, value)

    def __getitem__(self, name: str) -> Any:
        return self.inner[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self.inner[name] = value

    def __contains__(self, name: str) -> bool:
        return name in self.inner


def watch_device(device: Device) -> DeviceTime:
    """Put a watch into an open device that has done nothing yet."""
    ctx: Any = device.ctx
    watch = DeviceTime(ctx, device.hardware)

    def bare(value: Any) -> Any:
        return value.inner if isinstance(value, Watched) else value

    def size_of(data: Any) -> int:
        return 0 if data is None else memoryview(data).nbytes

    def texture(size: Any, components: int, data: Any = None, *rest: Any, **named: Any) -> Any:
        made = watch.time("upload", size_of(data), lambda: ctx.texture(size, components, data, *rest, **named))

        def write(source: Any, *inner: Any, **options: Any) -> Any:
            """From memory, or from a buffer on the device."""
            inside = isinstance(source, Watched)
            part, moved = ("kernel", 0) if inside else ("upload", size_of(source))
            return watch.time(part, moved, lambda: made.write(bare(source), *inner, **options))

        return Watched(made, write=write)

    def buffer(data: Any = None, **named: Any) -> Any:
        made = watch.time("upload", size_of(data), lambda: ctx.buffer(data, **named)) if data else ctx.buffer(**named)

        def read_into(target: Any, *rest: Any, **options: Any) -> Any:
            return watch.time("readback", size_of(target), lambda: made.read_into(target, *rest, **options))

        def write(source: Any, *rest: Any, **options: Any) -> Any:
            return watch.time("upload", size_of(source), lambda: made.write(source, *rest, **options))

        return Watched(made, read_into=read_into, write=write)

    def compute_shader(*given: Any, **named: Any) -> Any:
        made = ctx.compute_shader(*given, **named)
        return Watched(
            made, run=lambda *groups, **options: watch.time("kernel", 0, lambda: made.run(*groups, **options))
        )

    def vertex_array(program: Any, content: Any, *rest: Any, **named: Any) -> Any:
        made = ctx.vertex_array(bare(program), content, *rest, **named)

        def transform(target: Any, *inner: Any, **options: Any) -> Any:
            return watch.time("kernel", 0, lambda: made.transform(bare(target), *inner, **options))

        return Watched(made, transform=transform)

    device.ctx = Watched(ctx, texture=texture, buffer=buffer, compute_shader=compute_shader, vertex_array=vertex_array)  # type: ignore[assignment]
    return watch


def copy_rate(device: Device, size: int) -> tuple[float, float]:
    """Bytes a second that the device writes when it copies ``size`` bytes, and that come back from it."""
    ctx: Any = device.ctx
    ctx = ctx.inner if isinstance(ctx, Watched) else ctx
    watch = DeviceTime(ctx, device.hardware)
    source, target = ctx.buffer(reserve=size), ctx.buffer(reserve=size)
    back = bytearray(size)
    rates = []
    for _ in range(4):
        with watch.running():
            watch.time("kernel", size, lambda: ctx.copy_buffer(target, source, size))
            watch.time("readback", size, lambda: target.read_into(back))
        rates.append((size / watch.device["kernel"], size / watch.wall["readback"]))
    source.release()
    target.release()
    return max(rate[0] for rate in rates), max(rate[1] for rate in rates)
