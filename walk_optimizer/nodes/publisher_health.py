"""What the reference publisher tells operators about itself on `/diagnostics`."""

from walk_optimizer.nodes.bag import StreamBag
from walk_optimizer.nodes.diagnostics import Diagnostics, Finding, Level
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.remote_service import RemoteService
from walk_optimizer.nodes.speed_commands import SpeedCommands
from walk_optimizer.nodes.walk_commands import WalkCommands
from walk_optimizer.recording.status import RecorderStatus
from walk_optimizer.walk.phase_clock import Motion

_CHECKS = ("walk", "commands", "library", "timing", "recording")
_MILLISECONDS = 1e3
_MEGABYTE = 1e6
# A stream of 1 Hz is the slowest, in [s].
_LONG_SILENCE = 2.0
# The part of the recorder's queue beyond which it is no ordinary flush that messages wait for.
_LONG_QUEUE = 0.1


class PublisherHealth:
    """The checks of the publisher. Owns their sentences, not what they look at."""

    def __init__(
        self,
        diagnostics: Diagnostics,
        stream: JointStream,
        commands: WalkCommands,
        speeds: SpeedCommands,
        library: RemoteService,
        bag: StreamBag,
    ) -> None:
        """Add the checks to a node's."""
        self._diagnostics, self._stream, self._bag = diagnostics, stream, bag
        self._commands, self._speeds, self._library = commands, speeds, library
        self._holds = 0
        checks = (self._walk, self._refusal, self._library_there, self._timing, self._recording)
        for name, check in zip(_CHECKS, checks, strict=True):
            diagnostics.add(name, check)

    def close(self) -> None:
        """Take the checks away again."""
        for name in _CHECKS:
            self._diagnostics.remove(name)

    def _walk(self) -> Finding:
        report = self._stream.report
        text = "; ".join(filter(None, (str(report), self._commands.under_way)))
        values = {"state": report.state, "speed": report.speed, "target_speed": report.target_speed}
        if report.state == Motion.EMERGENCY_STOP.value:
            return Finding(Level.ERROR, text, values)
        silence = self._speeds.silence
        if silence:
            return Finding(Level.WARN, f"{text}; {silence}", values)
        return Finding(Level.OK, text, values)

    def _refusal(self) -> Finding:
        refusal = self._commands.refusal
        if refusal:
            return Finding(Level.WARN, f"the last speed was refused: {refusal}")
        return Finding(Level.OK, "no speed is refused")

    def _library_there(self) -> Finding:
        return self._library.finding(
            "library",
            "no other gait can be walked, stops work; start gait_library, or set `library_service` to its "
            "service",
        )

    def _timing(self) -> Finding:
        punctuality = self._stream.punctuality()
        if punctuality is None:
            return Finding(Level.OK, "nothing is streamed")
        values: dict[str, object] = {"rate": punctuality.rate}
        for name, three in (("lateness", punctuality.lateness), ("jitter", punctuality.jitter)):
            for kind, value in zip(("median", "99_percent", "max"), three, strict=True):
                values[f"{name}_{kind}_ms"] = value * _MILLISECONDS
        values |= {"missed_last_second": punctuality.missed, "missed": self._stream.missed}
        clock = self._stream.walk.clock
        held, self._holds = max(clock.holds - self._holds, 0), clock.holds
        values["clock_jumps"] = clock.holds
        if not self._stream.running:
            return Finding(Level.WARN, "nothing is streamed: the parameter `streaming` is false", values)
        if self._stream.silence > _LONG_SILENCE:
            text = (
                f"no reference for {self._stream.silence:.1f} s: the clock stands still, start what "
                "publishes /clock or set `use_sim_time` to false; or see `reference lost` in the log"
            )
            return Finding(Level.WARN, text, values)
        if held:
            text = (
                f"the clock moved back, or further than `longest_gap` ({clock.longest_gap:g} s) between two "
                f"references, {held} times in the last second: the walk holds then; if the clock has to run "
                "so, raise `longest_gap`"
            )
            return Finding(Level.WARN, text, values)
        if punctuality.missed:
            text = (
                f"{punctuality.missed} references of the last second were missed: lower `rate`, or give the "
            )
            return Finding(Level.WARN, text + "node a core that does nothing else", values)
        return Finding(Level.OK, f"{punctuality.rate:.1f} Hz, none missed", values)

    def _recording(self) -> Finding:
        recorder = self._bag.recorder
        if recorder is None:
            if self._bag.error is not None:
                return Finding(Level.ERROR, f"not recording: {self._bag.error}")
            return Finding(Level.OK, "not recording")
        status = recorder.status()
        values = _recording_values(status)
        if status.error is not None:
            return Finding(Level.ERROR, f"recording has ended: {status.error}", values)
        if status.dropped:
            text = f"{status.dropped} messages are not in the bag: the disk is too slow"
            return Finding(Level.WARN, text, values)
        limit = recorder.settings.queue_messages
        if status.queued > _LONG_QUEUE * limit:
            text = (
                f"{status.queued} messages wait for the disk, from {limit} on they are dropped: record fewer "
                "topics, or to a faster disk"
            )
            return Finding(Level.WARN, text, values)
        return Finding(Level.OK, f"recording to {status.directory}", values)


def _recording_values(status: RecorderStatus) -> dict[str, object]:
    return {
        "directory": status.directory,
        "messages": status.messages,
        "queued": status.queued,
        "dropped": status.dropped,
        "size_mb": status.size_bytes / _MEGABYTE,
        "free_mb": status.free_bytes / _MEGABYTE,
    }
