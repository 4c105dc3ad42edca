"""What ablate, smooth and tune say of a recorded run: the sensors of the golden bag, estimated again."""

import json
from pathlib import Path

import pytest
import yaml
from rosbags.rosbag2 import Reader

from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.topics import find_stream

pytestmark = [pytest.mark.ros, pytest.mark.slow]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup import cli  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link" / "bag"
LEFT_OUT = ("estimator", "controller")


@pytest.fixture(scope="module")
def sensors_only(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The golden bag without what estimator and controller said."""
    metadata = yaml.safe_load((GOLDEN / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    with Reader(GOLDEN) as reader:
        messages = [(connection.topic, t, bytes(data)) for connection, t, data in reader.messages()]
    streams = {name: find_stream(name) for name, _, _ in messages}
    kept = {name: stream for name, stream in streams.items() if stream and stream.publisher not in LEFT_OUT}
    folder = tmp_path_factory.mktemp("bag") / "sensors_only"
    with BagWriter(folder, list(kept.values()), metadata["custom_data"]) as writer:
        for name, t, data in messages:
            if name in kept:
                writer.write(name, t, data)
    return folder


def test_ablation_tells_that_the_encoder_buys_most_and_the_camera_nothing(
    sensors_only: Path, tmp_path: Path
) -> None:
    """One second of a single link: its encoder is ten times better than its camera."""
    files = tmp_path / "a.json", tmp_path / "a.html"
    assert cli.main(["ablate", str(sensors_only), "--json", str(files[0]), "--html", str(files[1])]) == 0
    rows = {row[0]: row for row in json.loads(files[0].read_text())["tables"][0]["rows"]}
    assert set(rows) == {"none", "encoder", "root_strain", "tip_accelerometer", "camera"}
    assert rows["encoder"][2] == max(row[2] for row in rows.values())
    assert rows["encoder"][2] > 3.0
    assert rows["camera"][2] == pytest.approx(1.0, abs=0.05)
    assert "<svg" in files[1].read_text()


def test_tuning_is_better_where_it_looked_and_where_it_did_not(sensors_only: Path, tmp_path: Path) -> None:
    file = tmp_path / "t.json"
    assert cli.main(["tune", str(sensors_only), "--json", str(file)]) == 0
    found = json.loads(file.read_text())
    worth = {row[0]: row for row in found["tables"][1]["rows"]}
    assert worth["log-likelihood, first half (tuned on)"][3] > 0.0
    assert worth["log-likelihood, second half (held out)"][3] > 0.0
    assert found["yaml"]


def test_who_looks_back_is_nearer_to_the_truth_and_says_so(tmp_path: Path) -> None:
    files = tmp_path / "s.json", tmp_path / "states.csv"
    assert cli.main(["smooth", str(GOLDEN), "--json", str(files[0]), "--csv", str(files[1])]) == 0
    filtered, smoothed = json.loads(files[0].read_text())["tables"][0]["rows"]
    assert smoothed[1] < 0.75 * filtered[1] and smoothed[2] < 0.75 * filtered[2]
    assert smoothed[1] < 2.0 * smoothed[2]  # it knows how well it knows
    assert len(files[1].read_text().splitlines()) == smoothed[3] + 1


def test_bag_that_cannot_be_used_ends_with_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("ablate", "smooth", "tune"):
        assert cli.main([command, str(tmp_path / "nothing")]) == 2
        assert "no such folder" in capsys.readouterr().err
