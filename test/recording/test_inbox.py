"""The queue between those who publish and the thread that writes."""

import time

from walk_optimizer.recording.inbox import Inbox

LONG = 60.0


def test_what_is_taken_at_a_rest_is_taken_after_the_pause():
    inbox = Inbox(limit=10, batch=1)
    inbox.offer("a message")
    inbox.rest()
    began = time.monotonic()
    assert inbox.take(patience=LONG, pause=0.05) == (["a message"], False)
    assert time.monotonic() - began >= 0.05


def test_a_closed_queue_is_emptied_at_once():
    inbox = Inbox(limit=10, batch=1)
    inbox.offer("a message")
    inbox.rest()
    inbox.close()
    began = time.monotonic()
    assert inbox.take(patience=LONG, pause=LONG) == (["a message"], True)
    assert time.monotonic() - began < LONG


def test_less_than_a_batch_waits_for_the_patience():
    inbox = Inbox(limit=10, batch=2)
    inbox.offer("a message")
    inbox.rest()
    began = time.monotonic()
    assert inbox.take(patience=0.05, pause=LONG) == (["a message"], False)
    assert 0.05 <= time.monotonic() - began < LONG
