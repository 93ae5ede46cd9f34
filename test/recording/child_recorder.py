"""A recording process for tests that kill it: `child_recorder.py MODE DIRECTORY`.

It says on its standard output how many messages were offered and how many are in closed chunks.
"""

import signal
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path
from types import FrameType

from recording.samples import JOINTS, PERIOD_NS, START_NS, joint_state

from walk_optimizer.recording import Recorder, RecorderSettings, RecorderStatus

NEVER = 1e6


def offer(recorder: Recorder, number: int) -> None:
    recorder.write(JOINTS.name, joint_state(number), START_NS + number * PERIOD_NS)


def say(recorder: Recorder, offered: int) -> None:
    print(offered, recorder.status().stored_messages, flush=True)


def open_chunk(recorder: Recorder) -> None:
    """Wait, with a chunk open."""
    pause(recorder, lambda status: status.messages)


def flushed(recorder: Recorder) -> None:
    """Wait, with all flushed."""
    pause(recorder, lambda status: status.stored_messages)


def pause(recorder: Recorder, progress: Callable[[RecorderStatus], int]) -> None:
    for number in range(2000):
        offer(recorder, number)
    while progress(recorder.status()) < 2000:
        time.sleep(0.001)
    say(recorder, 2000)
    time.sleep(NEVER)


def stream(recorder: Recorder) -> None:
    """Record without end, and end properly when asked to."""
    asked = []

    def ask(number: int, frame: FrameType | None) -> None:
        asked.append(number)

    signal.signal(signal.SIGTERM, ask)
    for number in count():
        if asked:
            recorder.stop()
            say(recorder, number)
            return
        offer(recorder, number)
        if number % 100 == 0:
            say(recorder, number + 1)
        time.sleep(0.0005)


def forget(recorder: Recorder) -> None:
    """End without having stopped the recorder."""
    for number in range(100):
        offer(recorder, number)


MODES = {"open_chunk": (open_chunk, NEVER), "flushed": (flushed, 0.05), "stream": (stream, 0.05)}
MODES["forget"] = (forget, NEVER)

if __name__ == "__main__":
    run, flush_period = MODES[sys.argv[1]]
    child = Recorder(Path(sys.argv[2]), RecorderSettings(flush_period=flush_period, min_free_bytes=0))
    child.add_topic(JOINTS)
    child.start()
    run(child)
