"""Print the figures of an imported body: ``python -m flexarm_model.fe_import arm.yaml body``."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from flexarm_model.fe_import.checks import check_model
from flexarm_model.fe_import.fe_model import load_model
from flexarm_model.fe_import.interfaces import make_interface
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


def main(arguments: Sequence[str]) -> int:
    """Print the checks of a body; returns 1 when there is a problem and 2 when there is no such body."""
    if len(arguments) != 2:
        print("usage: python -m flexarm_model.fe_import MANIPULATOR BODY", file=sys.stderr)
        return 2
    try:
        config = load_config(find_manipulator(arguments[0]))
        body = config.bodies.get(arguments[1])
        if not isinstance(body, ImportedBody):
            imported = [name for name, item in config.bodies.items() if isinstance(item, ImportedBody)]
            raise ValueError(
                f"body '{arguments[1]}': expected an imported one: {', '.join(imported) or 'none'}"
            )
        model = load_model(body)
        checks = check_model(
            model,
            [
                make_interface(model, name, nodes, body.nodes[name])
                for name, nodes in body.sets.items()
                if nodes.kind == "rigid"
            ],
        )
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    print(checks.text())
    return 1 if checks.problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
