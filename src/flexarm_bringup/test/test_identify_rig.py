"""``flexarm identify rig``: within limits, refused with bad sensors, true to an arm nobody described."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup import cli
from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.plan import Wish, plan_excitation
from flexarm_bringup.excite.rig_source import rig_settings
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_model.modal.modes import damped_poles
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linear_assembly import assemble

OTHER = PlantSettings(frequency_scale=float(np.sqrt(0.75)), mass_scale=1.3)
PERTURBED = [f"frequency_scale={OTHER.frequency_scale}", f"mass_scale={OTHER.mass_scale}"]


@pytest.fixture(scope="module")
def arm() -> HeldArm:
    return HeldArm(load_config(find_manipulator("single_link"), "geared"))


def test_the_plan_uses_the_share_of_the_limit_that_binds_and_no_more(arm: HeldArm) -> None:
    plans = [plan_excitation(arm, Wish(share=share)) for share in (0.1, 0.3)]
    assert plans[1].amplitude == pytest.approx(3 * plans[0].amplitude, rel=1e-6)  # the model is linear
    answer = arm.respond(np.tile(plans[1].excitation.signal[:, None] * plans[1].amplitude, (2, 1)))
    row = arm.model.outputs.names.index("root_strain.strain")
    assert plans[1].binding == "range of root_strain.strain"
    assert abs(answer.y[:, row]).max() == pytest.approx(0.3 * 1000e-6, rel=1e-6)


@pytest.mark.parametrize(("share", "rate"), [(0.1, 0.3), (0.3, 0.9), (0.6, 0.9), (1.0, 0.9)])
def test_the_plan_leaves_the_torque_its_rate_and_tells_how_much_of_it_is_used(
    share: float, rate: float
) -> None:
    """From a share of a third on the guard clipped the excitation, and a third of the rate was told."""
    light = HeldArm(load_config(find_manipulator("single_link"), "light_hub"))
    plan = plan_excitation(light, Wish(share=share))
    tau = light.respond(np.tile(plan.excitation.signal[:, None] * plan.amplitude, (2, 1))).tau
    (axis,) = light.config.actuated.values()
    used = abs(np.diff(tau, axis=0, prepend=0.0)).max() / light.dt / axis.effort_rate
    assert plan.binding == "torque rate of base.rz"
    assert used == pytest.approx(rate, rel=1e-6) and plan.used == pytest.approx(used, rel=1e-6)


def test_the_band_holds_the_served_modes_that_the_rate_allows(arm: HeldArm) -> None:
    low, high = plan_excitation(arm, Wish()).excitation.band_hz
    f_hz = abs(arm.elastic_poles) / (2 * np.pi)
    assert low < f_hz[0] < f_hz[1] < high <= 200.0 / 2.56


def test_a_setting_of_the_rig_that_does_not_exist_is_refused_with_those_that_do() -> None:
    with pytest.raises(SourceError, match="frequency_scale"):
        rig_settings(["stiffness=0.75"])
    assert rig_settings(["mass_scale=1.3"]).mass_scale == 1.3


def command(*more: str) -> list[str]:
    given = [word for text in PERTURBED for word in ("--perturb", text)]
    return ["identify", "rig", "--manipulator", "single_link", "--preset", "geared", *given, *more]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "verdict"),
    [
        ("root_strain: wrong factor -1", "root_strain.strain is flipped"),
        ("tip_accelerometer: stuck", "tip_accelerometer.y is dead"),
    ],
)
def test_a_bad_sensor_is_refused_by_name(
    fault: str, verdict: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(command("--faults", fault)) == 2
    said = capsys.readouterr()
    assert verdict in said.err and "--ignore-channel" in said.err and "Sensor check" in said.out


@pytest.mark.slow
@pytest.mark.parametrize("signal", ["multisine", "chirp", "prbs"])
def test_an_arm_that_is_softer_and_heavier_than_described_is_found_as_it_is(
    signal: str, tmp_path: Path
) -> None:
    config = perturb(load_config(find_manipulator("single_link"), "geared"), OTHER)
    built = assemble(config)
    poles = damped_poles(built.M, built.D, built.K)
    truth = np.sort(abs(poles[abs(poles) > 1.0]))[:2] / (2 * np.pi)
    report = tmp_path / "report.json"
    cli.main(command("--excite", signal, "--json", str(report)))
    rows = json.loads(report.read_text())["tables"][0]["rows"]
    f, zeta = np.array([row[1] for row in rows]), np.array([row[3] for row in rows])
    print(f"{signal}: {f} Hz, truth {truth}; {zeta} %")
    assert f == pytest.approx(truth, rel=1e-3)  # the arm bends by 0.4 thousandths: 0.05 % of it is geometry
    assert zeta == pytest.approx([1.66, 1.50], rel=0.03)


@pytest.mark.slow
def test_records_that_were_kept_give_the_same_modes_again(tmp_path: Path) -> None:
    reports = [tmp_path / "live.json", tmp_path / "file.json"]
    kept = tmp_path / "run.npz"
    cli.main(command("--save", str(kept), "--json", str(reports[0])))
    cli.main(["identify", str(kept), "--json", str(reports[1])])
    live, again = (json.loads(path.read_text())["tables"][0]["rows"] for path in reports)
    assert [row[1] for row in live] == pytest.approx([row[1] for row in again], rel=1e-9)
