"""What is written anew is there whole or not at all, and the disk's refusal is one line."""

import errno
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from bag_fixture import WRITTEN, write_bag

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.bag_writer import BagError, BagWriter, whole_or_nothing

# runs a command with files of at most 3000 bytes, which the disk's refusal is like
LIMITED = textwrap.dedent("""
    import resource, signal, sys
    from flexarm_bringup import cli
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
    sys.exit(cli.main(sys.argv[1:]))
""")


def test_a_recovery_that_the_disk_refuses_ends_with_two_and_can_be_tried_again(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag", ticks=50)
    command = [sys.executable, "-c", LIMITED, "recover", str(path), "--output", str(tmp_path / "new")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert done.returncode == 2
    told = f"flexarm recover: {tmp_path / 'new'} cannot be written: File too large\n"
    assert done.stderr == told
    assert not (tmp_path / "new").exists()


def test_a_copy_of_nothing_leaves_nothing(tmp_path: Path) -> None:
    bag = check_bag(write_bag(tmp_path / "bag"))
    with pytest.raises(BagError, match="holds no messages"):
        copy_bag(bag, tmp_path / "copy", [])
    assert not (tmp_path / "copy").exists()


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(errno.ENOSPC, "full"), RuntimeError("fault")])
def test_half_of_a_folder_goes_and_only_the_refusal_of_the_disk_is_told_as_such(
    error: BaseException, tmp_path: Path
) -> None:
    kind = BagError if isinstance(error, OSError) else type(error)
    with pytest.raises(kind), whole_or_nothing(tmp_path / "half"):
        (tmp_path / "half").mkdir()
        (tmp_path / "half" / "file").write_text("")
        raise error
    assert not (tmp_path / "half").exists()


def test_what_was_there_before_stays(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    with pytest.raises(BagError, match="exists already"), whole_or_nothing(path):
        pass
    assert check_bag(path).records


def test_a_recorder_that_cannot_keep_a_file_leaves_no_folder(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="cannot be created"):
        BagWriter(tmp_path / "bag", WRITTEN, {}, files={"description/x.csv": tmp_path / "missing.csv"})
    assert not (tmp_path / "bag").exists()
