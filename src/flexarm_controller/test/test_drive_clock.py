"""What the stamps of the drives say: of their period, of a clock that stands or jumps, of scatter."""

from random import Random

import pytest

from flexarm_controller.drives.drive_clock import DriveClock

T_NS, EPOCH_NS = 5_000_000, 1_700_000_000_000_000_000


def told(stamps):
    """Return a clock that was told stamps after the epoch [periods], and the faults on the way."""
    clock, faults = DriveClock(T_NS, 0.05), []
    for stamp in stamps:
        clock.take(EPOCH_NS + round(stamp * T_NS))
        faults.append(clock.fault)
    return clock, faults


@pytest.mark.parametrize(
    ("every", "said"), [(0.5, "2.5 ms"), (0.2, "1 ms"), (2.0, "10 ms"), (1.1, "5.5 ms"), (0.9, "4.5 ms")]
)
def test_drives_of_another_rate_are_named_with_both_periods(every, said):
    clock, _ = told(every * k for k in range(100))
    assert clock.unready() == f"drives tell every {said}, the arm's period is 5 ms"


@pytest.mark.parametrize("every", [0.96, 1.0, 1.04])
def test_drives_that_are_off_by_less_than_a_twentieth_of_the_period_may_be_armed(every):
    clock, faults = told(every * k for k in range(100))
    assert clock.unready() == "" and not any(faults)


def test_states_that_are_lost_on_the_way_are_no_other_rate():
    rng = Random(0)
    clock, faults = told(k for k in range(400) if rng.random() > 0.2)
    assert clock.unready() == "" and not any(faults)


def test_stamps_that_scatter_by_a_fifth_of_the_period_are_believed():
    rng = Random(0)
    clock, faults = told(k + rng.uniform(-0.2, 0.2) for k in range(400))
    assert clock.unready() == "" and not any(faults)


def test_stamps_that_scatter_by_nearly_half_a_period_are_said_to_be_too_near():
    rng = Random(2)
    clock, faults = told(k + rng.uniform(-0.4, 0.4) for k in range(400))
    near = "stamps of two states of the drives are "
    assert clock.unready().startswith(near) and clock.unready().endswith(
        " ms apart, the arm's period is 5 ms"
    )
    assert {fault[: len(near)] for fault in faults} == {"", near}


@pytest.mark.parametrize(("stamp_ns", "said"), [(0, "is 0"), (EPOCH_NS, "does not advance")])
def test_a_stamp_that_stands_is_no_jump(stamp_ns, said):
    clock = DriveClock(T_NS, 0.05)
    for _ in range(100):
        clock.take(stamp_ns)
    assert clock.fault == clock.unready()
    assert clock.fault == f"stamp of the drives {said}: it has to be the begin of each period"


def test_a_clock_that_jumps_is_forgotten_when_it_goes_on_from_there():
    clock, faults = told([0, 1, 2, 3, 5000, 5001])
    assert faults == ["", "", "", "", "clock of the drives jumped by 25 s", ""]
    assert clock.unready() == ""
    clock, faults = told([0, 1, -5])
    assert faults[-1] == clock.unready() == "clock of the drives jumped by -0.03 s"


def test_periods_that_were_lost_are_counted():
    clock = DriveClock(T_NS, 0.05)
    assert [clock.take(EPOCH_NS + k * T_NS) for k in (0, 1, 4)] == [1, 1, 3]
