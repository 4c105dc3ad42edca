import numpy as np
import pytest
from finite_difference import assert_jacobian
from planar_strip import (
    ACCELEROMETER,
    CAMERA,
    ENCODER,
    ROW_SENSORS,
    SENSORS,
    StripKinematics,
    camera_sample,
    strip_model,
)

from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.model_errors import with_model_errors
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import LinearRows, build_sensor_models
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.manipulator.sensor_spec import SensorSpec

MODEL = strip_model()
SYSTEM = ProcessModel(MODEL, EstimatorConfig()).system
MODELS = build_sensor_models(SENSORS, MODEL, SYSTEM, PlainTip(MODEL, StripKinematics()))


def random_state(rng):
    x = rng.normal(size=9) * np.array([1.0, 0.05, 0.002, 2e-4, 2.0, 1.0, 0.5, 0.2, 1.0])
    return x, np.array([3.0 * rng.normal(), 1.0])


@pytest.mark.parametrize("sensor", [spec.name for spec in SENSORS])
def test_jacobian_equals_finite_differences_of_the_innovation(sensor):
    rng = np.random.default_rng(3)
    model = MODELS.all()[sensor]
    x, u = random_state(rng)
    y = camera_sample(x, 0.0).y if sensor == "camera" else np.zeros(1)
    assert_jacobian(lambda x: -model.innovation(y, x, u), x, model.jacobian(x))


def test_rows_equal_the_outputs_of_the_second_order_model():
    x, u = random_state(np.random.default_rng(4))
    xi, rate, d = x[:4], x[4:8], x[8]
    acceleration = np.linalg.solve(
        MODEL.M, MODEL.B[:, 0] * (u[0] + d) - MODEL.f0 - MODEL.D @ rate - MODEL.K @ (xi - MODEL.xi0)
    )
    out = MODEL.outputs
    y = out.y0 + out.C_pos @ (xi - MODEL.xi0) + out.C_vel @ rate + out.C_acc @ acceleration
    for row, spec in enumerate(ROW_SENSORS):
        nu = MODELS.rows[spec.name].innovation(y[row : row + 1], x, u)
        np.testing.assert_allclose(nu, 0.0, atol=1e-9)


def test_the_accelerometer_feels_the_torque_and_the_encoder_does_not():
    full_torque = 28.0  # N m
    assert abs(MODELS.rows["tip_accelerometer"].D[0, 0]) * full_torque > 10 * ACCELEROMETER.sigma[0]
    assert MODELS.rows["encoder"].D[0, 0] == 0.0


def test_what_the_model_leaves_out_of_an_acceleration_is_added_to_its_noise():
    config = EstimatorConfig(acceleration_error=0.4)
    wide, *others = with_model_errors((ACCELEROMETER, ENCODER, CAMERA), config)
    np.testing.assert_allclose(wide.sigma**2, ACCELEROMETER.sigma**2 + 0.16)
    for spec, before in zip(others, (ENCODER, CAMERA), strict=True):
        np.testing.assert_array_equal(spec.sigma, before.sigma)


def test_sensors_that_locate_the_axes_are_known():
    assert [name for name, model in MODELS.all().items() if model.locates] == ["encoder", "camera"]


def test_a_camera_half_a_turn_away_has_a_large_innovation():
    x = np.zeros(9)
    turned = np.array([0.64, 0.0, 0.0, 0.0, 0.0, np.pi])
    nu = MODELS.poses["camera"].innovation(turned, x, np.array([0.0, 1.0]))
    assert np.linalg.norm(nu[3:]) == pytest.approx(np.pi, rel=1e-9)


def test_a_sensor_without_an_output_row_is_named():
    spec = SensorSpec("wrist_gauge", "strain_gauge", "strip.gauge", ("strain",), np.array([1e-6]))
    with pytest.raises(KeyError, match="wrist_gauge.*known.*encoder"):
        LinearRows(spec, MODEL, SYSTEM)
    spec = SensorSpec("tip_accelerometer", "accelerometer", "strip.sensor", ("y", "z"), np.full(2, 0.03))
    with pytest.raises(KeyError, match="tip_accelerometer.z.*known.*tip_accelerometer.y"):
        LinearRows(spec, MODEL, SYSTEM)


def test_the_noise_of_the_description_is_used():
    np.testing.assert_allclose(MODELS.rows["encoder"].R, [[ENCODER.sigma[0] ** 2]])
    np.testing.assert_allclose(MODELS.rows["tip_accelerometer"].R, [[ACCELEROMETER.sigma[0] ** 2]])
    np.testing.assert_allclose(np.diag(MODELS.poses["camera"].R), CAMERA.sigma**2)
