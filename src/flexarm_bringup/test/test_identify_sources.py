"""Set-ups, bags and records without inputs as sources of ``flexarm identify``."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bag_fixture import PERIOD_NS, joint_state, stamped_header, write_bag
from identify_files import STIFFNESS
from scipy import signal

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError, BagWriter
from flexarm_bringup.identify import bag_source, output_only
from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.bag_source import listen, read_bag
from flexarm_bringup.identify.measurement import Records, Responses, SourceError, checked
from flexarm_bringup.identify.page import _doubts
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.set_ups import check_scale
from flexarm_bringup.identify.sources import of_records, read_sources
from flexarm_bringup.page.report import Table
from flexarm_bringup.topics import STREAMS
from flexarm_model.identification.ssi import Dropped, OutputModes
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

F_HZ, ZETA, RATE = np.array([9.0, 23.0]), 0.01, 200.0


def ringing(seed: int, seconds: float, names: tuple[str, ...], gains: np.ndarray) -> Records:
    """Return noise on a torque and what sensors with these gains on two modes say."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(round(seconds * RATE))
    modal = []
    for omega in 2 * np.pi * F_HZ:
        b, a, _ = signal.cont2discrete(([omega], [1.0, 2 * ZETA * omega, omega**2]), 1 / RATE, method="zoh")
        modal.append(signal.lfilter(b.ravel(), a, x))
    y = np.array(modal).T @ gains
    y += 0.01 * y.std(axis=0) * rng.standard_normal(y.shape)
    return Records(RATE, {"torque": x}, dict(zip(names, y.T, strict=True)), "receptance", is_held=True)


GAINS = np.array([[1.0, 0.8, -0.5], [0.6, -0.9, 0.7]])


def test_roving_sensors_with_a_common_one_are_one_matrix_and_a_change_of_scale_is_told() -> None:
    first = ringing(1, 60.0, ("a", "b"), GAINS[:, :2])
    second = ringing(2, 60.0, ("a", "c"), GAINS[:, [0, 2]] * [1.1, 1.0])
    source = of_records([first, second], Averaging(resolution_hz=0.25))
    assert source.responses.outputs == ("a", "b", "c")
    assert any("a/torque is 109" in remark for remark in source.remarks)
    with pytest.raises(SourceError, match="not one test"):
        of_records([first, ringing(2, 60.0, ("a", "c"), 2 * GAINS[:, [0, 2]])], Averaging(0.25))


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (
            -1.0,
            r"a/f is 100.0 % in set-up 2 .*other sign, [+-]180.0 deg.* direction or polarity of a or of f",
        ),
        (1j, r"a/f is 100.0 % .* \+90.0 degrees of phase.* another quantity"),
        (-1.3, r"a/f is 130.0 % .*other sign"),
    ],
)
def test_set_ups_of_another_sign_or_phase_are_refused_as_those_of_another_gain(
    factor: complex, said: str
) -> None:
    """The common response was averaged with its own negative, and every shape was wrong."""
    first = Responses(np.arange(4.0), {("a", "f"): np.array([1.0, 2j, -1.0, 0.5])}, {}, "mobility")
    with pytest.raises(SourceError, match=said):
        check_scale([first, replace(first, cells={("a", "f"): factor * first.cells["a", "f"]})])
    late = replace(first, cells={("a", "f"): np.exp(-0.05j) * first.cells["a", "f"]})
    assert "-2.9 degrees of phase" in check_scale([first, late])[0]
    assert not check_scale([first, first])


def test_runs_whose_channels_come_in_another_order_are_runs_of_one_set_up() -> None:
    """They were two set-ups, of which no half was predicted from the other."""
    first, second = (ringing(seed, 20.0, ("a", "b"), GAINS[:, :2]) for seed in (1, 2))
    turned = replace(second, outputs=dict(reversed(second.outputs.items())))
    together, apart = (of_records([first, run], Averaging(0.5)) for run in (second, turned))
    assert not any("set-up" in remark for remark in apart.remarks) and len(apart.records) == 2
    for cell, values in together.responses.cells.items():
        np.testing.assert_array_equal(apart.responses.cells[cell], values)


def test_set_ups_without_a_common_response_are_told() -> None:
    ones = np.ones(4, complex)
    parts = [Responses(np.arange(4.0), {(name, "f"): ones}, {}, "mobility") for name in "ab"]
    assert "nothing shows" in check_scale(parts)[0]


def write_ringing_bag(path: Path, record: Records) -> Path:
    """Write torque, encoder and gauge of a record as a bag of the single link."""
    types = bag_types()
    streams = tuple(s for s in STREAMS if s.topic in ("joint_states", "strain", "applied_effort"))
    custom = {
        "description": find_manipulator("single_link").read_text(), "preset": "", "settings": "{}",
        "manipulator": "single_link",
    }  # fmt: skip
    with BagWriter(path, streams, custom) as writer:
        for k, tau in enumerate(record.inputs["torque"]):
            stamp = k * PERIOD_NS
            writer.write("/flexarm/joint_states", stamp, joint_state(stamp, float(record.outputs["a"][k])))
            strain = types.types["flexarm_interfaces/msg/StrainArray"](
                stamped_header(stamp), ["root_strain"], np.array([record.outputs["b"][k]]), np.zeros(1)
            )
            writer.write("/flexarm/strain", stamp, bytes(types.serialize_cdr(strain, strain.__msgtype__)))
            effort = types.types["sensor_msgs/msg/JointState"](
                stamped_header(stamp), ["base.rz"], np.zeros(0), np.zeros(0), np.array([tau])
            )
            writer.write(
                "/flexarm/applied_effort", stamp, bytes(types.serialize_cdr(effort, effort.__msgtype__))
            )
    return path


@pytest.fixture(scope="module")
def ringing_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    record = ringing(3, 30.0, ("a", "b"), GAINS[:, :2])
    return write_ringing_bag(tmp_path_factory.mktemp("bags") / "bag", record)


@pytest.mark.slow
def test_a_bag_gives_its_torque_and_sensors_at_even_instants(ringing_bag: Path) -> None:
    record = read_bag(ringing_bag)
    assert set(record.outputs) == {"encoder.position", "root_strain.strain"}
    assert set(record.inputs) == {"base.rz"} and record.is_held and record.is_of_moves
    assert record.outputs["encoder.position"].size == pytest.approx(30.0 * RATE, abs=2)


def test_samples_of_a_bag_are_at_the_instants_at_which_they_were_taken(tmp_path: Path) -> None:
    """A gauge whose driver stamps four periods late, as the estimator takes it; the encoder is in time."""
    path = write_ringing_bag(tmp_path / "bag", ringing(4, 0.5, ("a", "b"), GAINS[:, :2]))
    prompt = load_config(find_manipulator("single_link"))
    delay = 4 * PERIOD_NS * 1e-9
    specs = [replace(spec, stamp_delay=delay * (spec.name == "root_strain")) for spec in prompt.sensors]
    as_stamped, heard = (listen(check_bag(path), c) for c in (prompt, replace(prompt, sensors=tuple(specs))))
    for channel, late in (("root_strain.strain", delay), ("encoder.position", 0.0)):
        times, values = heard[channel]
        assert times == pytest.approx(as_stamped[channel][0] - late, abs=1e-9)
        assert (values == as_stamped[channel][1]).all()


def found(tmp_path: Path, *arguments: str) -> np.ndarray:
    report = tmp_path / "report.json"
    code = cli.main(["identify", *arguments, "--json", str(report), "--html", str(tmp_path / "p.html")])
    assert code in (0, 1)
    rows = json.loads(report.read_text())["tables"][0]["rows"]
    return np.array([[row[1], row[3]] for row in rows])


@pytest.mark.slow
def test_a_bag_is_identified_by_its_torque_and_says_that_feedback_may_spoil_it(
    ringing_bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    modes = found(tmp_path, str(ringing_bag), "--resolution", "0.1", "--band", "5", "30")
    assert modes[:, 0] == pytest.approx(F_HZ, rel=0.003)
    assert "without an instrument H1 mixes" in capsys.readouterr().out


@pytest.mark.slow
def test_a_record_without_inputs_gives_its_modes_by_subspaces(ringing_bag: Path, tmp_path: Path) -> None:
    modes = found(tmp_path, str(ringing_bag), "--output-only", "--band", "5", "30")
    assert modes[:, 0] == pytest.approx(F_HZ, rel=0.01)
    assert modes[:, 1] == pytest.approx([1.0, 1.0], abs=1.0)  # three sigma: 30 s tell it to 0.35
    page = (tmp_path / "p.html").read_text()
    assert "Stabilisation chart" in page and "<animate" in page and "http" not in page.split("</svg>")[-1]


def test_samples_without_a_number_are_told_with_their_channel_where_every_one_is_needed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither is the channel left out in silence, nor is all of the record said to stand still."""
    path, record = tmp_path / "run.npz", ringing(5, 5.0, ("a", "b"), GAINS[:, :2])
    spoilt = np.array(record.outputs["a"])
    spoilt[[70, 71, 300]] = np.nan, np.inf, np.nan
    t = np.arange(spoilt.size) / RATE
    for outputs in ({"out:a": spoilt}, {"out:a": spoilt, "out:b": record.outputs["b"]}):
        np.savez(path, **{"t": t, **outputs})
        assert cli.main(["identify", str(path), "--output-only", "--band", "5", "30"]) == 2
        assert f"{path}: not finite: 3 of 1000 samples of a; repair" in capsys.readouterr().err


@pytest.fixture(scope="module")
def short_bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    record = ringing(6, 0.5, ("a", "b"), GAINS[:, :2])
    return write_ringing_bag(tmp_path_factory.mktemp("bags") / "bag", record)


def test_a_bag_of_another_arm_is_refused_with_both_arms(
    short_bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for joints in (["--joints"], []):
        assert cli.main(["identify", str(short_bag), *joints, "--manipulator", "serial_6r"]) == 2
        said = capsys.readouterr().err
        assert f"{short_bag}: recorded with single_link (axes base.rz; sensors encoder, " in said
        assert "not with serial_6r (axes " in said


def test_the_same_arm_with_other_values_or_sensors_fits_a_bag(short_bag: Path) -> None:
    softer = load_config(find_manipulator("single_link"), "", {STIFFNESS: "150 GPa"})
    for sensors in (softer.sensors, softer.sensors[:1]):
        assert read_bag(short_bag, replace(softer, sensors=sensors)).outputs
    strangers = tuple(replace(spec, name=f"my_{spec.name}") for spec in softer.sensors)
    with pytest.raises(SourceError, match="recorded with single_link .* not with single_link .*my_encoder"):
        read_bag(short_bag, replace(softer, sensors=strangers))


def test_a_bag_that_does_not_say_its_arm_is_taken_for_that_of_the_description(
    short_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its messages show that they do not fit."""

    def unknown(bag: Bag) -> tuple[object, object]:
        raise BagError(f"{bag.path}: does not say it")

    monkeypatch.setattr(bag_source, "configuration", unknown)
    assert read_bag(short_bag, load_config(find_manipulator("single_link"))).outputs
    with pytest.raises(SourceError, match="no sensor of this manipulator"):
        read_bag(short_bag, load_config(find_manipulator("planar_3rrr")))


def test_joints_are_read_where_they_were_and_modes_about_their_mean(tmp_path: Path) -> None:
    """Weight and inertia were worked out at a pose that the arm never had."""
    config = load_config(find_manipulator("single_link"), "geared")
    path = write_bag(tmp_path / "bag", ticks=100)
    as_they_were, about_mean = (read_bag(path, config, is_centred=each).outputs for each in (False, True))
    assert as_they_were["encoder.position"].mean() == pytest.approx(4.9, abs=0.1)
    assert about_mean["encoder.position"].mean() == pytest.approx(0.0, abs=1e-9)


def told_reference(begin: float, points: int, acceleration: float) -> Any:
    """Return a message of type trajectory_msgs/JointTrajectory, as ``listen`` reads it."""
    every = [
        SimpleNamespace(
            time_from_start=SimpleNamespace(sec=0, nanosec=k * PERIOD_NS), accelerations=[acceleration]
        )
        for k in range(points)
    ]
    header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=round(1e9 * begin)))
    return SimpleNamespace(header=header, joint_names=["base.rz"], points=every)


def heard_in(monkeypatch: pytest.MonkeyPatch, bag: Path, *references: Any) -> Records:
    """Return what is read of a bag in which these references were told as well."""
    records = [
        *check_bag(bag).records,
        *(SimpleNamespace(name="/flexarm/reference", told=told) for told in references),
    ]
    decode = bag_source.decode
    monkeypatch.setattr(bag_source, "decode", lambda r: r.told if hasattr(r, "told") else decode(r))
    monkeypatch.setattr(bag_source, "check_bag", lambda *_: replace(check_bag(bag), records=tuple(records)))
    return read_bag(bag)


def test_the_ringing_after_a_move_is_read_too(short_bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bag was cut to the time that its reference covers."""
    whole = read_bag(short_bag).inputs["base.rz"]
    moved = heard_in(monkeypatch, short_bag, told_reference(0.1, 20, 3.0))
    np.testing.assert_array_equal(moved.inputs["base.rz"], whole)
    asked = moved.instruments["base.rz"]
    assert (asked[25:35] == 3.0).all() and not asked[:15].any() and not asked[45:].any()


def test_a_reference_ends_what_the_one_before_asks_for(
    short_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = told_reference(0.1, 60, 3.0), told_reference(0.2025, 60, -1.0)
    asked = heard_in(monkeypatch, short_bag, first, second).instruments["base.rz"]
    assert (asked[45:90] == -1.0).all() and (asked[25:38] == 3.0).all()


def test_references_without_accelerations_are_no_instruments(
    short_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bare = told_reference(0.1, 60, 3.0)
    for point in bare.points:
        point.accelerations = []
    assert not heard_in(monkeypatch, short_bag, bare).instruments
    assert not heard_in(monkeypatch, short_bag, told_reference(0.2, 20, 3.0), bare).instruments


def test_two_sessions_in_one_bag_are_refused(short_bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag = check_bag(short_bag)
    half = len(bag.records) // 2
    turned = replace(bag, records=(*bag.records[half:], *bag.records[:half]))
    monkeypatch.setattr(bag_source, "check_bag", lambda *_: turned)
    with pytest.raises(SourceError, match=r"joint_states go back from .* two sessions in one bag"):
        read_bag(short_bag)


def test_a_clock_that_was_set_ahead_is_told(short_bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The instants between 1970 and now took 2.47 TiB."""
    decode = bag_source.decode

    def told_late(record: Any) -> Any:
        msg = decode(record)
        if hasattr(msg, "header") and msg.header.stamp.sec + msg.header.stamp.nanosec > 0:
            msg.header.stamp.sec += 1_700_000_000
        return msg

    monkeypatch.setattr(bag_source, "decode", told_late)
    with pytest.raises(SourceError, match=r"joint_states jump from 0\.000 to 17\d+\.\d+ s: .* a clock"):
        read_bag(short_bag)


def test_a_modal_test_that_was_interrupted_is_told(short_bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was read as the bag of an arm that nobody had excited."""
    bag = check_bag(short_bag)
    assert not any("modal test" in line for line in read_bag(short_bag).remarks)
    record = next(r for r in bag.records if r.name.endswith("joint_states"))
    begun = replace(bag, records=(*bag.records, replace(record, name=bag_source.EXCITATION)))
    monkeypatch.setattr(bag_source, "check_bag", lambda *_: begun)
    assert "did not come to its end" in read_bag(short_bag).remarks[0]


@pytest.mark.parametrize(
    ("what", "other"),
    [("kind", "accelerance"), ("kinds", {"a": "mobility"}), ("repeats", 1300), ("is_held", False)],
)
def test_runs_that_mean_other_things_by_their_numbers_are_not_averaged(what: str, other: Any) -> None:
    first = replace(ringing(1, 20.0, ("a", "b"), GAINS[:, :2]), repeats=1000)
    second = replace(first, **{what: other})
    with pytest.raises(SourceError, match=f"differ in '{what}'"):
        of_records([first, second], Averaging())


def test_feedback_is_told_of_a_bag_or_beside_an_instrument_and_not_of_every_torque_that_is_held() -> None:
    held = ringing(1, 20.0, ("a", "b"), GAINS[:, :2])
    fed_back = replace(held, instruments={"torque": held.inputs["torque"]})
    runs = ((held, ""), (replace(held, is_of_moves=True), ""), (fed_back, "H1"), (fed_back, "Hc"))
    said = [" ".join(of_records([run], Averaging(estimator=by)).remarks) for run, by in runs]
    assert ["answers to the sensors" in text for text in said] == [False, True, True, False]


def test_several_set_ups_say_that_no_half_was_predicted_from_the_other() -> None:
    first, second = ringing(1, 60.0, ("a", "b"), GAINS[:, :2]), ringing(2, 60.0, ("a", "c"), GAINS[:, [0, 2]])
    source = of_records([first, second], Averaging(0.25))
    assert any("no half" in remark for remark in source.remarks)
    assert [len(runs) for runs in source.set_ups] == [1, 1]


@pytest.mark.parametrize("value", [95.0, -0.5])
def test_what_is_no_coherence_is_refused(value: float) -> None:
    ones, cell = np.ones(4), ("a", "f")
    responses = Responses(np.arange(4.0), {cell: ones + 0j}, {cell: value * ones}, "mobility")
    with pytest.raises(SourceError, match=r"coherence of a/f goes from .* expected 0 to 1"):
        checked(Path("table.csv"), responses)
    assert checked(Path("table.csv"), replace(responses, coherence={cell: ones * 1.000001}))


def test_an_array_in_the_place_of_an_archive_is_told(tmp_path: Path) -> None:
    np.save(tmp_path / "x.npy", np.arange(3.0))
    (tmp_path / "x.npy").rename(tmp_path / "x.npz")
    with pytest.raises(SourceError, match="cannot be read: one array without a name; expected an archive"):
        read_sources([tmp_path / "x.npz"], "receptance", Averaging())


def test_a_band_that_begins_far_below_the_slowest_mode_is_told() -> None:
    """One mode of 40 Hz was up to five in a band from 2.5 Hz on, and one in a band from 20 Hz on."""
    modes = OutputModes(*np.full((4, 1), 9.0), np.ones((1, 1), complex), np.array([4]), 4, rings_down=False)
    far, near = (output_only._limits(modes, band) for band in ((1.4, 30.0), (5.0, 30.0)))
    assert "may show as several" in far[0] and far[0].endswith("look at it with --band 4.5 30")
    assert far[1:] == near
    two = replace(modes, f_hz=np.array([2.0, 9.0]))  # of the strip, whose second mode showed twice
    assert output_only._limits(two, (1.4, 30.0)) == far
    left_out = replace(modes, dropped=(Dropped(15.0, 0.104, 2, 4),))
    assert output_only._limits(left_out, (5.0, 30.0))[0].startswith(
        "15 Hz (10.4 % damping) is left out: the whole record shows it, but only 2 of its 4 parts"
    )


def test_the_page_says_how_many_parts_show_a_mode_and_that_a_record_rings_down() -> None:
    """Dampings of 1 % were told as 0.89 and 0.96 %, those of a hammer's record too."""
    t = np.arange(0.0, 20.0, 1 / RATE)
    parts = [np.exp(-ZETA * w * t) * np.sin(w * np.sqrt(1 - ZETA**2) * t) for w in 2 * np.pi * F_HZ]
    outputs = {name: parts[0] + gain * parts[1] for name, gain in (("a", 0.5), ("b", -0.8))}
    page = output_only.output_only_page(
        [Path("rung.npz")], [Records(RATE, {}, outputs, "receptance")], (5.0, 30.0)
    )
    table = page.items[0]
    assert isinstance(table, Table) and "the record rings down" in table.notes[1]
    assert [row[-1] for row in table.rows] == ["4 of 4", "4 of 4"]
    assert [row[3] for row in table.rows] == pytest.approx([1.0, 1.0], abs=1e-4)


def test_a_channel_that_is_left_out_is_told_with_why(
    short_bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = check_bag(short_bag)
    encoders = [r for r in bag.records if r.name.endswith("joint_states")]
    kept = [r for r in bag.records if r not in encoders[20:60]]
    monkeypatch.setattr(bag_source, "check_bag", lambda *_: replace(bag, records=tuple(kept)))
    found = read_bag(short_bag)
    assert "encoder.position" not in found.outputs
    assert found.remarks[0] == "encoder.position is left out: it was silent for 0.205 s"
    assert any("tip_accelerometer" in line and "no number" in line for line in found.remarks)
    assert found.remarks[0] in of_records([found], Averaging()).remarks


def test_a_record_of_moves_in_which_no_mode_stands_out_names_the_modal_test() -> None:
    """The drift watch had proposed to identify such a bag, and the page did not say why it held no mode.

    A table of a test whose drive holds its torque was told the same.
    """
    record = ringing(1, 5.0, ("a", "b"), GAINS[:, :2])
    noise = np.random.default_rng(2).standard_normal((2, record.inputs["torque"].size))
    moved = replace(record, outputs=dict(zip("ab", noise, strict=True)), is_of_moves=True)
    source = of_records([moved], Averaging(resolution_hz=2.0))
    result = identify(source, Request(None, 0.6))
    excited = replace(result, source=replace(source, set_ups=((replace(moved, is_of_moves=False),),)))
    for found, is_told in ((result, True), (excited, False)):
        said = " ".join(_doubts(found))
        assert "no mode stands out" in said
        assert ("flexarm identify rig --nodes join" in said) is is_told
