"""Panel of running frequencies, as the drift watch finds them in a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flexarm_bringup.bag_plots.series import BagSeries
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.drift_run.bag import settings_for, watch_bag
from flexarm_bringup.drift_run.figure import draw_watched
from flexarm_model.settings.strict_yaml import ConfigError

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot


def draw_drift(plot: Plot, series: BagSeries) -> None:
    """Draw the change of every watched mode's frequency, or say why there is none."""
    try:
        settings = settings_for(configuration(series.bag)[0])
        watched = watch_bag(series.bag, settings)
    except (BagError, ConfigError) as error:
        plot.text(0.5, 0.5, f"no running frequencies: {error}", ha="center", va="center", wrap=True)
        return
    draw_watched(plot, watched, settings.frequency_change)
