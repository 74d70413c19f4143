"""Single values without a clock: output to 0 V, enable line, reading of an input.

The run and its guardian both use this, each with its own connection.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from dearig.drivers.daqmx.explain import RESERVED, instrument_errors
from dearig.drivers.daqmx.link import Link
from dearig.drivers.errors import NotAtZero, RigError
from dearig.drivers.settings import RigSettings
from dearig.drivers.zero_reading import ZeroReading

if TYPE_CHECKING:
    import nidaqmx
    from nidaqmx.system import Device, WatchdogTask

__all__ = ["Outputs", "clear"]

T = TypeVar("T")

_MONITOR_READINGS = 20  # the amplifier's output falls in less than a millisecond
_AVERAGED = 10  # values of an input, whose mean is one reading
_OUTPUT, _ENABLE = "output", "enable line"  # keys of the tasks, with the inputs' names


class Outputs:
    """Outputs of the card ``device`` behind ``link``, of a rig with ``settings``.

    A task is made once for each output and input: making one takes ten calls of a server, writing a
    value takes one. It holds nothing of the card between two calls, except from ``shut`` to
    ``release``. Every method raises ``RigError`` where the card or its server fails.
    """

    def __init__(self, link: Link, device: str, settings: RigSettings) -> None:
        self._link = link
        self._device = device
        self._settings = settings
        self._tasks: dict[str, nidaqmx.Task] = {}
        self._card: Device | None = None
        self._keeps = False  # True while output and enable line stay reserved after a write
        self._resets = 0
        #: reading of the monitor after the last call that set 0 V, None where there is none
        self.zero_reading: ZeroReading | None = None

    def prepare(self) -> None:
        """Make every call of ``shut`` once: it then has nothing left to import, load or make.

        Afterwards nothing of the card is reserved.

        The output goes to 0 V and the enable line low, which a card in use refuses.
        """
        with self._errors():
            from nidaqmx.system import Device

            self._card = Device(self._device, grpc_options=self._link.session)
        self._keeps = True
        self._write_zero()
        self._disable()
        self.check_zero()
        self.release()
        # an error of the card loads code too; nothing changes at a terminal that does not exist
        with contextlib.suppress(RigError):
            self._with_task("no such terminal", self._add_unknown, _write_low)

    def zero(self, *, force: bool = False) -> None:
        """Set 0 V at the output, and check it on the voltage monitor.

        With ``force``, a card that is in use is reset, which aborts every task and
        takes outputs and lines down in one step.
        """
        self.zero_reading = None
        if force:
            self._forced(self._write_zero)
        else:
            self._write_zero()
        self.check_zero()

    def shut(self) -> None:
        """Set 0 V and the enable line low, also on a card in use, and check the monitor.

        Both stay reserved until ``release``. The card itself then refuses a task that would output
        or enable anything, such as the next call of a run that was frozen and goes on.
        """
        self.zero_reading = None
        self._keeps = True
        try:
            self._forced(self._write_zero)
        finally:
            resets = self._resets
            self._forced(self._disable)
        self._forced(self.check_zero)
        if self._resets != resets:
            raise RigError(
                f"card {self._device}: another program reserved it while its output was taken to "
                f"0 V: end the other program"
            )

    def release(self) -> None:
        """Let other tasks have output and enable line again; both keep their values."""
        self._keeps = False
        from nidaqmx.constants import TaskMode

        for key in (_OUTPUT, _ENABLE):
            task = self._tasks.get(key)
            if task is None:
                continue
            try:
                with self._errors():
                    task.control(TaskMode.TASK_UNRESERVE)
            except RigError:  # such as a task that a reset has ended: it is made again when needed
                self._drop(key)

    def disable(self) -> None:
        """Set the line that enables the amplifier's high voltage low, if it is wired."""
        self._forced(self._disable)

    def reset(self) -> None:
        """Abort every task of every program on the card; its outputs go to 0 V in one step."""
        with self._errors():
            if self._card is None:
                from nidaqmx.system import Device

                self._card = Device(self._device, grpc_options=self._link.session)
            self._resets += 1
            self._card.reset_device()

    def check_zero(self) -> None:
        """Raise ``NotAtZero`` unless the voltage monitor reads 0 within the limits' tolerance.

        ``zero_reading`` has the reading in both cases.
        """
        tolerance = self._settings.limits.zero_tolerance_kV
        per_volt = 1.0 / self._settings.amplifier.monitor_V_per_kV
        reading = 0.0
        for _ in range(_MONITOR_READINGS):
            reading = self.read("voltage_monitor") * per_volt
            confirmed = abs(reading) <= tolerance
            self.zero_reading = ZeroReading(reading * 1e3, time.time(), confirmed)
            if confirmed:
                return
        raise NotAtZero(
            f"the output was set to 0 V, but the voltage monitor still reads {reading:.3g} kV "
            f"({tolerance:g} kV is allowed): switch the amplifier's high voltage off by hand",
            reading * 1e3,
        )

    def read(self, channel: str) -> float:
        """Return the V at the input of ``channel`` now, the mean of ten values."""
        return self._with_task(channel, lambda task: self._add_input(task, channel), _read_mean)

    def close(self) -> None:
        """Clear the tasks; the output keeps its value."""
        for key in list(self._tasks):
            self._drop(key)

    def _forced(self, call: Callable[[], None]) -> None:
        """Do ``call``; where another task holds the card, reset it and repeat."""
        try:
            call()
        except RigError as error:
            if error.code != RESERVED:
                raise
            self.reset()
            call()

    def _disable(self) -> None:
        line = self._settings.card.do_hv_enable
        if line is not None:
            self._with_task(
                _ENABLE, lambda task: task.do_channels.add_do_chan(f"{self._device}/{line}"),
                _write_low,
            )  # fmt: skip

    def _write_zero(self) -> None:
        amplifier = self._settings.amplifier
        # the command for 0 V at the film, which includes the amplifier's offset
        volts = -amplifier.offset_V / amplifier.gain_V_per_V
        self._with_task(_OUTPUT, self._add_output, lambda task: _write_volts(task, volts))

    def _add_output(self, task: nidaqmx.Task) -> None:
        card = self._settings.card
        task.ao_channels.add_ao_voltage_chan(
            f"{self._device}/{card.ao_command}", min_val=-card.ao_range_V, max_val=card.ao_range_V
        )

    def _add_input(self, task: nidaqmx.Task, channel: str) -> None:
        from nidaqmx.constants import TerminalConfiguration

        settings = self._settings
        limit = settings.ranges()[channel]
        task.ai_channels.add_ai_voltage_chan(
            f"{self._device}/{settings.terminals()[channel]}",
            terminal_config=TerminalConfiguration[settings.wiring()[channel]],
            min_val=-limit,
            max_val=limit,
        )

    def _add_unknown(self, task: nidaqmx.Task) -> None:
        task.do_channels.add_do_chan(f"{self._device}/port99/line99")

    def _with_task(
        self, key: str, add: Callable[[nidaqmx.Task], object], use: Callable[[nidaqmx.Task], T]
    ) -> T:
        """Return ``use`` of the task ``key``, which is made with ``add`` where it is missing.

        A task may have been aborted or cleared by a reset, or by a new start of the server: then
        it is made again.
        """
        try:
            return self._used(key, add, use)
        except RigError as error:
            if error.code in (None, RESERVED):
                raise
            return self._used(key, add, use)

    def _used(
        self, key: str, add: Callable[[nidaqmx.Task], object], use: Callable[[nidaqmx.Task], T]
    ) -> T:
        import nidaqmx
        from nidaqmx.constants import TaskMode

        try:
            with self._errors():
                task = self._tasks.get(key)
                if task is None:
                    task = self._tasks[key] = nidaqmx.Task(grpc_options=self._link.session)
                    add(task)
                keeps = self._keeps and key in (_OUTPUT, _ENABLE)
                if keeps:
                    task.control(TaskMode.TASK_RESERVE)
                result = use(task)
                if not keeps:
                    task.control(TaskMode.TASK_UNRESERVE)
                return result
        except RigError as error:
            if error.code != RESERVED:
                self._drop(key)
            raise

    def _drop(self, key: str) -> None:
        task = self._tasks.pop(key, None)
        if task is not None:
            with contextlib.suppress(RigError), self._errors():
                clear(task)

    def _errors(self) -> contextlib.AbstractContextManager[None]:
        return instrument_errors(self._device, self._link.server, answered=self._link.answered)


def clear(task: nidaqmx.Task | WatchdogTask) -> None:
    """Clear ``task``; one that cannot be cleared raises here, and not as a warning at the end."""
    try:
        task.close()
    finally:
        task._handle = None


def _write_volts(task: nidaqmx.Task, volts: float) -> None:
    from nidaqmx.stream_writers import AnalogSingleChannelWriter

    AnalogSingleChannelWriter(task.out_stream, auto_start=True).write_one_sample(volts)


def _write_low(task: nidaqmx.Task) -> None:
    from nidaqmx.stream_writers import DigitalSingleChannelWriter

    writer = DigitalSingleChannelWriter(task.out_stream, auto_start=True)
    writer.verify_array_shape = False  # one line is one line, and the check costs two calls
    writer.write_one_sample_one_line(False)


def _read_mean(task: nidaqmx.Task) -> float:
    from nidaqmx.stream_readers import AnalogSingleChannelReader

    values = np.empty(_AVERAGED)
    reader = AnalogSingleChannelReader(task.in_stream)
    reader.verify_array_shape = False
    reader.read_many_sample(values, _AVERAGED)
    return float(np.mean(values))
