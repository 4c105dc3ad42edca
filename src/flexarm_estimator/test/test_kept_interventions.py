"""What stands goes from one estimator to the next: of another process, or of the same activated again."""

import pytest
from estimator_exchange import exchange

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_estimator.exchange", reason="needs ROS and flexarm_interfaces")

from flexarm_estimator.interventions.kept_interventions import KeptInterventions  # noqa: E402
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor  # noqa: E402
from flexarm_model.process.kept import MARK  # noqa: E402

NAME = "/flexarm/estimator"
AGAIN = "goes on with what services had switched or set before: root_strain is off"


@pytest.fixture
def said():
    return []


@pytest.fixture
def ended(said):
    """Give an estimator of a process whose user has switched a gauge off, and who keeps that."""
    kept, made = KeptInterventions(NAME, said.append), exchange()
    kept.hand_to(made)
    made.intervene(ToggleSensor("root_strain", False))
    kept.take_from(made)
    return kept


def is_off_after_a_step(kept):
    fresh = exchange()
    kept.hand_to(fresh)
    fresh.step(0)
    return fresh.estimator.health.is_off("root_strain")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(MARK, str(tmp_path))
    return tmp_path


def test_the_next_process_does_it_again_and_says_so(folder, ended, said):
    assert said == []
    assert is_off_after_a_step(KeptInterventions(NAME, said.append))
    assert said == [AGAIN]


def test_a_node_that_is_activated_again_does_it_again_also_without_a_folder(monkeypatch, said):
    monkeypatch.delenv(MARK, raising=False)
    kept, made = KeptInterventions(NAME, said.append), exchange()
    made.intervene(ToggleSensor("root_strain", False))
    kept.take_from(made)
    assert is_off_after_a_step(kept)
    assert said == [AGAIN]


def test_what_cannot_be_read_is_told_as_lost(folder, ended, said):
    (folder / "flexarm.estimator.kept").write_text("[")
    assert not is_off_after_a_step(KeptInterventions(NAME, said.append))
    assert len(said) == 1
    assert said[0].startswith("what services had switched or set before is lost: ")


def test_what_cannot_be_written_is_told_as_at_risk(folder, ended, said):
    (folder / "flexarm.estimator.new").mkdir()
    made = exchange()
    ended.take_from(made)
    assert len(said) == 1
    assert said[0].startswith("a crash would lose what services have switched or set: ")
