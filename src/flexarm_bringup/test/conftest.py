"""Lets the tests of this folder import what they share (``bag_fixture``), whatever the import mode."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
