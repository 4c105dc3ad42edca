"""``flexarm identify --update --retune``: settings for the updated description, written and tried."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from flexarm_bringup.page.report import Page
from flexarm_bringup.retune.moves_text import with_settings
from flexarm_bringup.retune.noise import frequency_doubt
from flexarm_bringup.retune.page import retune_tables
from flexarm_bringup.retune.proposal import propose, settings_now
from flexarm_bringup.retune.task_text import task_text
from flexarm_bringup.retune.trial import not_learning, run_trial
from flexarm_bringup.share import share_path
from flexarm_bringup.tasks.task import FOLDER, Task, load_task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.whole_file import written_whole
from flexarm_model.identification.model_update import Update
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


def moves_beside(description: Path) -> Path:
    """Return where the retuned moves go when nobody says: beside the description."""
    return description.with_name(f"{description.stem}_moves.yaml")


def retune(
    manipulator: str, preset: str, description: Path, update: Update, output: Path, say: Callable[[str], None]
) -> Callable[[Page], Page]:
    """Retune for a description that was just written, try it, write the moves file.

    Args:
        manipulator: Name or file of the description before.
        preset: Of both.
        description: The new one.
        update: How it came about.
        output: Moves file to write.
        say: Is told what is done.

    Returns:
        What adds the tables to a page.

    Raises:
        ValueError: There are no moves, the arm cannot do them, or their file cannot be changed as it is.
    """
    task = task_for(manipulator)
    text = _moves_text(manipulator, task)
    own = preset if preset in task.preset_settings else ""
    task = task.under(preset)
    with_settings(text, settings_now(task), str(description.resolve()), own)  # told before minutes of search
    old, new = load_config(find_manipulator(manipulator), preset), load_config(description, preset)
    proposal = propose(old, new, task, frequency_doubt(update), say)
    say("moves before and after")
    trials = run_trial(old, proposal.old, task, new), run_trial(new, proposal.new, task, new)
    unlearned = None
    if proposal.new != not_learning(proposal.new):
        say("moves before and after, with a law that does not learn")
        unlearned = (
            run_trial(old, not_learning(proposal.old), task, new),
            run_trial(new, not_learning(proposal.new), task, new),
        )
    text = with_settings(text, proposal.changes, str(description.resolve()), own)
    with written_whole(output, text) as written:
        load_task(written)
    tables = retune_tables(proposal, trials, unlearned)

    def add(page: Page) -> Page:
        """Return the page with the tables and where the settings were written."""
        remarks = dict(page.remarks)
        remarks["Written"] = [*remarks.get("Written", []), f"wrote {output}: moves with the new settings"]
        return Page(page.title, page.lead, [*tables, *page.items], page.checks, remarks, page.data)

    return add


def _moves_text(manipulator: str, task: Task) -> str:
    """Return the moves file that comes along, or one of the tour that an arm without any is sent on."""
    if not manipulator.endswith((".yaml", ".yml")):
        try:
            return share_path(f"{FOLDER}/{manipulator}.yaml").read_text(encoding="utf-8")
        except FileNotFoundError:
            pass
    return task_text(replace(task, assumed=task.assumed[:1]))  # the rest is that nobody has tuned it
