"""The back ends by name, and what to install for those that are missing."""

import importlib
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

from walk_optimizer.errors import MissingDependencyError

if TYPE_CHECKING:
    from walk_optimizer.solve.back_end import BackEnd


@dataclass(frozen=True)
class BackEndEntry:
    """A back end that can be chosen.

    Attributes:
        name: In the settings; its module below `walk_optimizer.solve` has the same name.
        method: What it is, for people.
        plugin: CasADi's name of it; empty for one that comes from elsewhere.
        package: Python package that it needs beside CasADi; empty for none.
        remedy: What to do where it is missing.
        condenses: Whether steps in single support that begin near a solution are left to the condensed
            method: an interior point as well, which knows such steps.
    """

    name: str
    method: str
    plugin: str = ""
    package: str = ""
    remedy: str = "install the wheel casadi==3.8.2, whose build has it"
    condenses: bool = False

    @property
    def missing(self) -> str | None:
        """Why it can't be used here and what to do; None where it can be."""
        if self.package and find_spec(self.package) is None:
            return f"back end {self.name} needs the Python package {self.package}: {self.remedy}"
        if self.plugin:
            # Here, not above: naming the back ends must not load CasADi.
            import casadi as ca

            if not ca.has_nlpsol(self.plugin):
                return f"back end {self.name} is not in this build of CasADi: {self.remedy}"
        return None


BACK_ENDS = {
    entry.name: entry
    for entry in (
        BackEndEntry("ipopt", "interior point, sparse factorisation", plugin="ipopt", condenses=True),
        BackEndEntry("uno", "sequential quadratic programming, filter and trust region", plugin="uno"),
        BackEndEntry("fatrop", "interior point, Riccati recursion along the stages", plugin="fatrop"),
        BackEndEntry(
            "snopt",
            "sequential quadratic programming, quasi-Newton",
            package="pydrake",
            remedy="pip install 'walk-optimizer[snopt]'",
        ),
    )
}


def back_end(name: str) -> "BackEnd":
    """Return a back end, ready for work.

    Args:
        name: A key of `BACK_ENDS`.

    Raises:
        MissingDependencyError: its library is missing; says what to install.
    """
    reason = BACK_ENDS[name].missing
    if reason is not None:
        raise MissingDependencyError(reason)
    module: BackEnd = importlib.import_module(f"walk_optimizer.solve.{name}")
    return module
