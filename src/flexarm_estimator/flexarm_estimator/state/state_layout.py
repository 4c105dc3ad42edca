"""Where things stand in the filter's state ``x = [theta; eta; theta'; eta'; d; b; w; s; p]``.

``theta`` are the actuated axes, ``eta`` the elastic modes, ``d`` unmodelled torques on the axes, ``b`` the
biases of sensors (a gauge drifts with temperature, an accelerometer has an offset), in SI of their channel,
``w`` the share by which the arm sags further than modelled and ``s`` all static deflections of the modes
that the model leaves out (``sag``), ``p`` what is learned of the model itself (``stiffness``). The controller
is told ``s`` and ``p``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class StateLayout:
    """Sizes and places.

    Attributes:
        n: Number of served coordinates xi = [theta; eta].
        n_theta: Number of actuated axes, and of unmodelled torques.
        biases: Output rows "sensor.channel" that have a bias, in their order in the state; behind them
            "sensor.channel rate" of those that drift steadily.
        n_w: Number of shares of sag, 0 or 1.
        n_s: Number of static deflections, of the slowest modes.
        n_p: Number of learned parameters of the model.
        n_learned: Number of slowest modes whose common stiffness is learned.
    """

    n: int
    n_theta: int
    biases: tuple[str, ...] = ()
    n_w: int = 0
    n_s: int = 0
    n_p: int = 0
    n_learned: int = 0

    @cached_property
    def n_x(self) -> int:
        """Number of states."""
        return 2 * self.n + self.n_theta + len(self.biases) + self.n_w + self.n_s + self.n_p

    @cached_property
    def theta(self) -> slice:
        """Actuated axes [rad] or [m]."""
        return slice(0, self.n_theta)

    @cached_property
    def eta(self) -> slice:
        """Modal displacements [kg^0.5 m]."""
        return slice(self.n_theta, self.n)

    @cached_property
    def theta_dot(self) -> slice:
        """Velocities of the axes [rad/s] or [m/s]."""
        return slice(self.n, self.n + self.n_theta)

    @cached_property
    def eta_dot(self) -> slice:
        """Modal velocities [kg^0.5 m/s]."""
        return slice(self.n + self.n_theta, 2 * self.n)

    @cached_property
    def d(self) -> slice:
        """Unmodelled torques [N m] or [N]."""
        return slice(2 * self.n, 2 * self.n + self.n_theta)

    @cached_property
    def b(self) -> slice:
        """Biases of sensors, SI of their channel."""
        return slice(self.d.stop, self.d.stop + len(self.biases))

    @cached_property
    def w(self) -> slice:
        """Share by which the arm sags further than modelled [1]."""
        return slice(self.b.stop, self.b.stop + self.n_w)

    @cached_property
    def s(self) -> slice:
        """Static deflections of the modes [kg^0.5 m]."""
        return slice(self.w.stop, self.w.stop + self.n_s)

    @cached_property
    def p(self) -> slice:
        """Learned parameters of the model, relative [1]."""
        return slice(self.s.stop, self.n_x)

    @cached_property
    def told(self) -> slice:
        """What messages carry with its covariance: all but sag and learned parameters."""
        return slice(0, self.b.stop)
