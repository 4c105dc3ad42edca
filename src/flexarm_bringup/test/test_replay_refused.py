"""Replays that cannot be: the reason is never empty, it names the bag, and nothing is left behind."""

from dataclasses import replace
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.bags.bag_reader import Bag, check_bag  # noqa: E402
from flexarm_bringup.bags.bag_writer import BagError  # noqa: E402
from flexarm_bringup.replaying.replay_bag import OUTPUTS, replay  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402
from flexarm_model.settings.parameters import ParameterError  # noqa: E402

RECORDED = Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"


@pytest.fixture(scope="module")
def bag() -> Bag:
    return check_bag(RECORDED)


def beginning(bag: Bag) -> Bag:
    """Return the bag until its fifth tick."""
    ticks = [record.log_time_ns for record in bag.records if record.name == "/flexarm/tick"]
    return replace(bag, records=tuple(r for r in bag.records if r.log_time_ns <= ticks[4]))


def test_an_estimator_that_takes_the_model_and_says_nothing_is_told(
    bag: Bag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(EstimatorExchange, "step", lambda self, stamp_ns: ())
    with pytest.raises(BagError) as caught:
        replay(beginning(bag), tmp_path / "new")
    reason = "its model was taken, but no estimate came of its measurements"
    assert str(caught.value) == f"{bag.path}: gives no {OUTPUTS[0]}: {reason}"
    assert not (tmp_path / "new").exists()


def test_settings_that_cannot_be_name_the_bag(bag: Bag, tmp_path: Path) -> None:
    odd = replace(bag, custom={**bag.custom, "settings": '{"estimator": {"gate": NaN}}'})
    with pytest.raises(ParameterError, match=f"^{bag.path}: its settings: gate"):
        replay(odd, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_fault_in_the_middle_of_a_replay_leaves_no_half_bag(
    bag: Bag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = list[int]()

    def step(self: EstimatorExchange, stamp_ns: int) -> tuple[()]:
        """Fail at the third step."""
        steps.append(stamp_ns)
        if len(steps) == 3:
            raise RuntimeError("fault")
        return ()

    monkeypatch.setattr(EstimatorExchange, "step", step)
    with pytest.raises(RuntimeError, match="fault"):
        replay(beginning(bag), tmp_path / "new")
    assert not (tmp_path / "new").exists()
