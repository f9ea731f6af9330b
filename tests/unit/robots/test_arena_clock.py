import time

import pytest

from turing_learning.robots._clock import RealClock, VirtualClock


def test_a_virtual_clock_passes_only_while_somebody_waits():
    clock = VirtualClock()
    assert clock.now() == 0.0
    clock.sleep(2.5)
    clock.sleep(-1.0)
    assert clock.now() == 2.5


def test_actions_are_done_in_the_order_of_their_times_and_see_them():
    clock, seen = VirtualClock(), []
    for name, due in (("c", 3.0), ("a", 1.0), ("b", 1.0)):
        clock.call_at(due, lambda name=name: seen.append((name, clock.now())))
    clock.sleep(2.0)
    assert seen == [("a", 1.0), ("b", 1.0)]
    clock.sleep(1.0)
    assert seen[-1] == ("c", 3.0)


def test_an_action_may_put_down_the_next_one():
    clock, seen = VirtualClock(), []

    def tick():
        seen.append(clock.now())
        clock.call_at(clock.now() + 0.5, tick)

    clock.call_at(0.5, tick)
    clock.sleep(2.0)
    assert seen == [0.5, 1.0, 1.5, 2.0]


def test_what_was_due_in_the_past_is_done_at_once_when_somebody_waits():
    clock, seen = VirtualClock(), []
    clock.sleep(5.0)
    clock.call_at(1.0, lambda: seen.append(clock.now()))
    assert seen == []
    clock.sleep(0.0)
    assert seen == [5.0]


def test_an_action_that_waits_is_refused():
    clock = VirtualClock()
    clock.call_at(1.0, lambda: clock.sleep(1.0))
    with pytest.raises(RuntimeError, match="`sleep` must not be called by an action of the clock"):
        clock.sleep(2.0)


def test_a_fast_clock_shows_more_time_than_passes():
    clock = RealClock(speed=20.0)
    first, before, begun = time.monotonic(), clock.now(), time.monotonic()
    clock.sleep(1.0)
    ended, after, last = time.monotonic(), clock.now(), time.monotonic()
    assert ended - begun >= 0.05
    assert 20 * (ended - begun) <= after - before + 1e-6
    assert after - before <= 20 * (last - first) + 1e-6


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_clock_that_does_not_run_forward_is_refused(speed):
    with pytest.raises(ValueError, match="`speed` must be a finite number above 0; got"):
        RealClock(speed)
