"""The gate looks at the firm law, too, and the simulated rig does what it predicts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from flexarm_bringup.cli import main
from flexarm_bringup.closed_loop import LoopSettings, run_loop
from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.program.firm_motions import firm
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

KICK, SETTLED = 1e-4, 1.0  # kg^0.5 m/s: small beside every limit; s until the gains stand
PHASES = np.pi / 4 * np.arange(4)  # one of them is within 8 % of the worst


def settings_of(preset: str, firm_time: float) -> tuple[EstimatorConfig, MpcConfig]:
    task = task_for("single_link").under(preset)
    mpc = replace(task.make("mpc", MpcConfig), time_limit=0.0, firm_time=firm_time)
    return task.make("estimator", EstimatorConfig), mpc


def loop_of(preset: str, firm_time: float, filter_: EstimatorConfig | None = None) -> Loop:
    estimator, mpc = settings_of(preset, firm_time)
    estimator = filter_ or estimator
    return Loop(load_config(find_manipulator("single_link"), preset), estimator, (ControllerConfig(), mpc))


def test_the_geared_arm_may_be_firm_and_the_light_hub_may_not() -> None:
    assert loop_of("geared", 0.4).judge() == ""
    assert loop_of("light_hub", 0.0).judge() == ""
    reason = loop_of("light_hub", 0.4).judge()
    assert reason.startswith("margins: firm law: mode ")
    assert "within 0.6 s, 2 is allowed" in reason


def test_a_law_without_a_firm_time_is_judged_by_its_margins_only() -> None:
    look = loop_of("light_hub", 0.0).look()
    assert not look.firm and len(look.cases) == 5


def test_the_command_says_what_the_firm_law_lets_grow(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--preset", "light_hub", "--along", "0", "--set", "mpc.firm_time=0.4"]
    assert main(["margins", "single_link", *options]) == 1
    said = capsys.readouterr().out
    assert "Firm law: at most 2 is allowed" in said and "MISSED  firm law, pose home" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preset", "error", "mode"), [("light_hub", -0.1, 2), ("light_hub", 0.1, 1), ("geared", 0.1, 1)]
)
def test_a_kicked_mode_shakes_the_simulated_rig_as_much_as_predicted(
    preset: str, error: float, mode: int
) -> None:
    estimator = replace(settings_of(preset, 0.4)[0], stiffness_modes=0)  # or it learns on the rig meanwhile
    look = loop_of(preset, 0.4, estimator).look()
    case = next(case for case in look.firm if case.frequency_error == error)
    predicted = case.kicked[f"mode_{mode}"]  # nothing is divided: the ordinary law lets a served mode die out
    found = max(simulated(preset, error, mode, case.lasts, estimator, phase) for phase in PHASES)
    assert found == pytest.approx(predicted, rel=0.1)


def simulated(  # noqa: PLR0913, what is kicked, how, and under which filter
    preset: str, error: float, mode: int, lasts: float, estimator: EstimatorConfig, phase: float
) -> float:
    """Hold still with the firm law, kick a mode once; return the largest vibration over the kick's [1]."""
    config = load_config(find_manipulator("single_link"), preset)
    mpc = settings_of(preset, 0.0)[1]
    laws = replace(firm(mpc), stiffness_step=0.0, inertia_step=0.0)
    quiet = RigSettings(frequency_scale=1.0 + error, noise=1e-4)
    settings = LoopSettings(estimator=estimator, mpc=laws, rig=quiet)
    hardware = Hardware(config, settings.rig)
    plant = hardware.rig.plant
    M, _, K, _ = plant.tree.linearisation(plant.q)
    squares, shapes = eigh(K, M)
    rest, amplitude = plant.q.copy(), []

    def observe(rig: Hardware, estimate: Any) -> dict[str, np.ndarray]:
        r, r_dot = shapes.T @ M @ (plant.q - rest), shapes.T @ M @ plant.v
        amplitude.append(float(np.sqrt(np.sum(squares[1:] * r[1:] ** 2 + r_dot[1:] ** 2))))
        if rig.tick == round(SETTLED / rig.dt):
            plant.q = plant.q + KICK * np.sin(phase) / np.sqrt(squares[mode]) * shapes[:, mode]
            plant.v = plant.v + KICK * np.cos(phase) * shapes[:, mode]
        return {}

    run_loop(hardware, ReducedTree(config), hold(config.home), SETTLED + lasts, settings, observe)
    return max(amplitude[round(SETTLED / hardware.dt) + 1 :]) / KICK
