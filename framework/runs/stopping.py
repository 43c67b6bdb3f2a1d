"""Asking runs to stop: by a signal, or from another part of the program."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from grainlaw.arguments import Checked

#: signals that ask a run to stop, where the system has them
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stopped(KeyboardInterrupt):
    """A run that was asked to stop; ``result`` holds what was recorded, ``signal`` the number of the signal or 0."""

    result: Any

    def __init__(self, reason: str = "stopped", number: int = 0) -> None:
        super().__init__(reason)
        self.signal = number


class Stop(metaclass=Checked):
    """Asks runs to stop, at the next moment between two calls of the compiled step (some tenths of a second).

    Runs that share one are stopped together, also those in other threads.
    """

    def __init__(self) -> None:
        self.reason, self.signal = "", 0

    def ask(self, reason: str, number: int = 0) -> None:
        """Ask once; later reasons do not count."""
        if not self.reason:
            self.reason, self.signal = reason, number

    def check(self) -> None:
        """Raise :class:`Stopped` if asked."""
        if self.reason:
            raise Stopped(self.reason, self.signal)

    @contextmanager
    def by_signals(self, *, only_interrupt: bool = False) -> Iterator[Stop]:
        """Let Ctrl-C, and unless ``only_interrupt`` the signals TERM and HUP, ask to stop; the second ends at once.

        Only in the main thread, where alone Python allows it, and only for signals that the user has given no handler.
        """
        chosen = SIGNALS[:1] if only_interrupt else SIGNALS
        ours = [number for number in chosen if signal.getsignal(number) in _DEFAULTS]
        if threading.current_thread() is not threading.main_thread():
            ours = []
        before = {number: signal.signal(number, self._asked) for number in ours}
        try:
            yield self
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _asked(self, number: int, frame: FrameType | None) -> None:
        if self.reason:
            raise Stopped(self.reason, self.signal)
        name = signal.Signals(number).name
        self.ask("interrupted from the keyboard" if name == "SIGINT" else f"stopped by the signal {name}", number)


_DEFAULTS = (signal.SIG_DFL, signal.default_int_handler)
