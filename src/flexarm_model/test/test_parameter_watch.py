"""When a told parameter is worth other models, and what is said of one that cannot be."""

import pytest

from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.parameter_watch import ParameterWatch

BAR = 1e5


def heard(watch: ParameterWatch, name: str, value: float, variance: float = 0.0) -> bool:
    watch.hear(name, value, variance)
    return watch.is_due


@pytest.fixture
def watch() -> ParameterWatch:
    return ParameterWatch(load_config(find_manipulator("variable_stiffness")), 0.01)  # 1 to 2 bar, from 2 on


def test_a_change_is_worth_models_once_it_is_as_large_as_the_step(watch: ParameterWatch) -> None:
    assert not heard(watch, "pressure", 1.991 * BAR)
    assert heard(watch, "pressure", 1.98 * BAR)
    watch.use(watch.told())
    assert watch.used == {"pressure": 1.98 * BAR}
    assert not heard(watch, "pressure", 1.98 * BAR) and not heard(watch, "pressure", 1.9895 * BAR)


def test_what_its_own_noise_may_be_is_no_change(watch: ParameterWatch) -> None:
    assert not heard(watch, "pressure", 1.8 * BAR, (0.08 * BAR) ** 2)
    assert heard(watch, "pressure", 1.7 * BAR, (0.08 * BAR) ** 2)
    assert heard(watch, "pressure", 1.8 * BAR, -1.0) and heard(watch, "pressure", 1.8 * BAR, float("nan"))


def test_beyond_its_range_the_end_counts_and_is_told_where_noise_does_not_explain_it(
    watch: ParameterWatch,
) -> None:
    assert not heard(watch, "pressure", 2.005 * BAR) and not watch.trouble
    assert not heard(watch, "pressure", 2.2 * BAR)
    assert "220000 is not within 100000 ... 200000 where it is known; 200000 is taken" in watch.trouble
    assert heard(watch, "pressure", 0.2 * BAR) and watch.told() == {"pressure": 1.0 * BAR}
    assert heard(watch, "pressure", 1.5 * BAR) and not watch.trouble


def test_no_number_changes_nothing_and_is_told(watch: ParameterWatch) -> None:
    assert not heard(watch, "pressure", float("nan"))
    assert watch.told() == {"pressure": 2.0 * BAR} and "nan is no number; still 200000" in watch.trouble
    watch.refused = "no models"
    assert watch.trouble.startswith("no models; pressure")
    watch.use({"pressure": BAR})
    assert not watch.refused


def test_an_arm_without_parameters_has_nothing_to_watch() -> None:
    watch = ParameterWatch(load_config(find_manipulator("single_link")), 0.01)
    assert watch.used == {} and watch.trouble == ""
