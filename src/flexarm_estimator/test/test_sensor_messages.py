"""Messages of real drivers: what can be used of them, and the reason for what cannot."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planar_strip import single_link
from scipy.spatial.transform import Rotation

from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_model.manipulator.sensor_spec import SensorSpec

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
StrainArray = pytest.importorskip(
    "flexarm_interfaces.msg", reason="needs ROS and flexarm_interfaces"
).StrainArray
PoseWithCovarianceStamped = pytest.importorskip("geometry_msgs.msg").PoseWithCovarianceStamped
sensor_msgs = pytest.importorskip("sensor_msgs.msg")
Imu, JointState = sensor_msgs.Imu, sensor_msgs.JointState

READER = SensorReader(single_link())
CAMERA = next(spec for spec in single_link().sensors if spec.name == "camera")


def joints(**changes):
    fields = {"name": ["base.rz"], "position": [0.25], "velocity": [], "effort": []}
    return JointState(**{**fields, **changes})


def strain(**changes):
    fields = {"names": ["root_strain"], "strain": [1e-4], "standard_deviation": []}
    return StrainArray(**{**fields, **changes})


def imu(y=1.5, frame="strip.sensor", covariance=None):
    msg = Imu()
    msg.header.frame_id = frame
    msg.linear_acceleration.y = y
    msg.linear_acceleration_covariance = (
        np.zeros(9) if covariance is None else np.array(covariance, dtype=float)
    )
    return msg


def camera(rotvec=(0.1, -0.2, 0.3), frame="base", scale=1.0, covariance=None):
    msg = PoseWithCovarianceStamped()
    msg.header.frame_id = frame
    position, q = msg.pose.pose.position, msg.pose.pose.orientation
    position.x, position.y, position.z = 0.6, 0.1, 0.0
    q.x, q.y, q.z, q.w = (scale * Rotation.from_rotvec(rotvec).as_quat()).tolist()
    msg.pose.covariance = np.zeros(36) if covariance is None else np.array(covariance, dtype=float).ravel()
    return msg


def test_every_sensor_of_the_arm_has_its_topic():
    assert set(READER.topics) == {"joint_states", "strain", "imu/tip_accelerometer", "camera/pose"}


@pytest.mark.parametrize(
    ("topic", "msg", "sensor", "y"),
    [
        ("joint_states", joints(), "encoder", [0.25]),
        ("strain", strain(), "root_strain", [1e-4]),
        ("imu/tip_accelerometer", imu(), "tip_accelerometer", [1.5]),
        ("camera/pose", camera(), "camera", [0.6, 0.1, 0.0, 0.1, -0.2, 0.3]),
    ],
)
def test_a_good_message_gives_one_sample(topic, msg, sensor, y):
    reading = READER.read(topic, msg, 1.25)
    assert not reading.refusals
    (sample,) = reading.samples
    assert (sample.sensor, sample.t, sample.R) == (sensor, 1.25, None)
    np.testing.assert_allclose(sample.y, y, atol=1e-15)


@pytest.mark.parametrize(
    ("topic", "msg", "source", "words"),
    [
        ("joint_states", joints(position=[]), "encoder", "0 positions for 1 names"),
        ("joint_states", joints(name=[], position=[]), "encoder", "no joint 'base.rz'"),
        ("joint_states", joints(name=["elbow.rz"]), "joint_states", "unknown joint 'elbow.rz'"),
        ("joint_states", joints(name=["b", "a", "b"]), "joint_states", "unknown joints 'a', 'b'"),
        ("strain", strain(strain=[1.0, 2.0]), "root_strain", "1 names, 2 strains"),
        ("strain", strain(names=["other"]), "strain", "unknown gauge 'other'"),
        ("strain", strain(standard_deviation=[1.0, 1.0]), "root_strain", "2 sigmas"),
        ("imu/tip_accelerometer", imu(frame="imu_link"), "tip_accelerometer", "frame 'imu_link'"),
        ("imu/tip_accelerometer", imu(covariance=[-1.0] * 9), "tip_accelerometer", "not measured"),
        ("imu/elbow", imu(), "imu/elbow", "no sensor there"),
        ("camera/pose", camera(frame="camera_optical"), "camera", "frame 'camera_optical'"),
        ("camera/pose", camera(scale=0.0), "camera", "norm 0"),
        ("camera/pose", camera(scale=np.nan), "camera", "norm nan"),
    ],
)
def test_what_cannot_be_used_is_named(topic, msg, source, words):
    reading = READER.read(topic, msg, 0.0)
    assert not reading.samples
    assert any(refusal.source == source and words in refusal.reason for refusal in reading.refusals)


def test_covariances_are_carried_only_when_they_say_something_new():
    sigma2 = np.diag(CAMERA.sigma**2)
    for covariance, expected in ((sigma2, None), (np.zeros((6, 6)), None), (4 * sigma2, 4 * sigma2)):
        (sample,) = READER.read("camera/pose", camera(covariance=covariance), 0.0).samples
        assert (sample.R is None) == (expected is None)
        if expected is not None:
            np.testing.assert_allclose(sample.R, expected)
    (sample,) = READER.read("strain", strain(standard_deviation=[3e-6]), 0.0).samples
    np.testing.assert_allclose(sample.R, [[9e-12]])
    own = np.diag([-1.0, 0.25, -1.0]).ravel()  # REP 145: only y is measured
    (sample,) = READER.read("imu/tip_accelerometer", imu(covariance=own), 0.0).samples
    np.testing.assert_allclose(sample.R, [[0.25]])


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, 3.0, np.pi, -3.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_both_quaternions_of_a_rotation_give_its_vector(angle, sign):
    axis = np.array([0.6, 0.0, 0.8])
    (sample,) = READER.read("camera/pose", camera(axis * angle, scale=sign), 0.0).samples
    R = Rotation.from_rotvec(sample.y[3:]).as_matrix()
    np.testing.assert_allclose(R, Rotation.from_rotvec(axis * angle).as_matrix(), atol=1e-12)
    assert np.linalg.norm(sample.y[3:]) <= np.pi + 1e-12


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"effort": []}, "0 efforts for 1 names"),
        ({"name": ["elbow.rz"], "effort": [1.0]}, "no axis 'base.rz'"),
        ({"effort": [np.nan]}, "not finite"),
        ({"effort": [1e4]}, "more than 10 times the axis' limit"),
    ],
)
def test_a_torque_that_cannot_be_used_is_named(changes, words):
    torque, (refusal,) = READER.read_torque("applied_effort", joints(**changes))
    assert torque is None
    assert words in refusal.reason


def test_a_torque_is_read_by_the_names_of_the_axes():
    torque, refusals = READER.read_torque(
        "applied_effort", joints(name=["x.ty", "base.rz"], effort=[5.0, 2.0])
    )
    assert not refusals
    np.testing.assert_array_equal(torque, [2.0])


NUMBERS = st.floats(width=64)
ARRAYS = st.lists(NUMBERS, max_size=4)
NAMES = st.lists(st.sampled_from(["base.rz", "root_strain", "x", ""]), max_size=4)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(NAMES, ARRAYS, ARRAYS, st.lists(NUMBERS, min_size=36, max_size=36))
def test_no_message_raises(names, some, others, covariance):
    q = (some + [0.0] * 4)[:4]
    pose = camera(covariance=covariance)
    o = pose.pose.pose.orientation
    o.x, o.y, o.z, o.w = q
    messages = [
        ("joint_states", joints(name=names, position=some, velocity=others, effort=others)),
        ("strain", strain(names=names, strain=some, standard_deviation=[abs(v) for v in others])),
        ("imu/tip_accelerometer", imu(covariance=covariance[:9])),
        ("camera/pose", pose),
    ]
    with np.errstate(all="ignore"):
        for topic, msg in messages:
            reading = READER.read(topic, msg, 0.0)
            assert reading.samples or reading.refusals or not names
        READER.read_torque("applied_effort", messages[0][1])


def unit(**told):
    """Return a message of a unit: ``acceleration`` and ``rate`` in all axes, their covariances if given."""
    msg = Imu()
    msg.header.frame_id = "strip.sensor"
    for field, short in (("linear_acceleration", "acceleration"), ("angular_velocity", "rate")):
        vector, value = getattr(msg, field), told.get(short)
        vector.x, vector.y, vector.z = [0.0 if value is None else value] * 3
        covariance = told.get(f"{short}_covariance", np.zeros(9) if value is not None else [-1.0, *[0.0] * 8])
        getattr(msg, f"{field}_covariance")[:] = np.array(covariance, dtype=float)
    return msg


@pytest.fixture(scope="module")
def unit_reader():
    config = single_link()
    rate = SensorSpec("rate", "gyroscope", "strip.sensor", ("z",), np.array([1e-3]), imu="tip_accelerometer")
    return SensorReader(replace(config, sensors=(*config.sensors, rate)))


@pytest.mark.parametrize(
    ("told", "read"),
    [
        ({"acceleration": 1.5, "rate": 0.2}, {"tip_accelerometer": 1.5, "rate": 0.2}),
        ({"rate": 0.2}, {"rate": 0.2}),
        ({"acceleration": 1.5}, {"tip_accelerometer": 1.5}),
        ({}, {}),
    ],
)
def test_a_unit_says_what_it_measures(unit_reader, told, read):
    """REP 145: -1 in the first place marks a part that is not measured, whatever stands in the others."""
    reading = unit_reader.read("imu/tip_accelerometer", unit(**told), 1.0)
    assert {sample.sensor: float(sample.y[0]) for sample in reading.samples} == read
    refused = {refusal.source: refusal.reason for refusal in reading.refusals}
    assert set(refused) == (set() if read else {"tip_accelerometer", "rate"})
    assert read or "angular velocity is not measured" in refused["rate"]


def test_an_accelerometer_without_the_first_axis_is_absent_too(unit_reader):
    """Its own axis has a covariance of zero in such a message: zero was read as a sample."""
    reading = READER.read("imu/tip_accelerometer", unit(rate=0.2), 1.0)
    assert not reading.samples and "linear acceleration is not measured" in reading.refusals[0].reason


def test_what_a_unit_tells_of_its_noise_is_its_own(unit_reader):
    told = unit(acceleration=1.5, rate=0.2, rate_covariance=np.diag([1.0, 1.0, 4e-4]).ravel())
    samples = {s.sensor: s.R for s in unit_reader.read("imu/tip_accelerometer", told, 1.0).samples}
    assert samples["tip_accelerometer"] is None
    np.testing.assert_array_equal(samples["rate"], [[4e-4]])
