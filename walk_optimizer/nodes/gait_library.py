"""Node `gait_library`: serves the gait table at once, and asks the optimiser for what it lacks."""

import sys
from collections import Counter

from walk_optimizer_interfaces.msg import GaitTable
from walk_optimizer_interfaces.srv import GetGait, ListGaits, OptimizeGait, Rebuild

from walk_optimizer.errors import (
    GaitNotFoundError,
    GaitNotWritableError,
    InvalidRequestError,
    SolveFailedError,
    WalkOptimizerError,
)
from walk_optimizer.gait import Gait
from walk_optimizer.library import EXACT_SPEED_TOLERANCE, GaitLibrary, Selection, Source, parse_selection
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.nodes.blends import Blends
from walk_optimizer.nodes.conversions import gait_from_message, gait_to_message, summary_to_message
from walk_optimizer.nodes.diagnostics import Finding, Level
from walk_optimizer.nodes.lifecycle import ManagedNode
from walk_optimizer.nodes.log_text import with_fields
from walk_optimizer.nodes.parameters import Setting, require_name
from walk_optimizer.nodes.paths import named_path
from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.running import run_node
from walk_optimizer.nodes.suite_node import ServiceUnavailableError
from walk_optimizer.nodes.walker_setting import WALKER_FILE, walker_of
from walk_optimizer.request import GaitRequest, gait_table_settings

OPTIMIZER = "optimizer"

_TABLE = gait_table_settings()
# Gaits that one request may have rebuilt: the table three times over.
_MOST_REBUILT = 3 * _TABLE.gaits * len(SpringMode)
_FREE_SPACE = "make the folder writable or free space, then call ~/rebuild for them"

SETTINGS = [
    WALKER_FILE,
    Setting(
        "points",
        _TABLE.points,
        "Grid points N of the gaits that the optimizer is asked for [-].",
        _TABLE.minimum_points,
        _TABLE.maximum_points,
    ),
    Setting(
        "cache_folder",
        "",
        "Existing folder for gaits that were solved on request; empty for the user's cache.",
        read_only=True,
    ),
    Setting(
        "optimizer_service",
        "gait_optimizer/optimize_gait",
        "Service that is asked for gaits that the table lacks.",
        check=require_name,
        read_only=True,
    ),
    Setting("optimizer_timeout", 900.0, "Longest wait for the optimizer's answer [s].", 1.0, 86_400.0),
]


class GaitLibraryNode(ManagedNode):
    """Offers `~/get_gait`, `~/list_gaits`, `~/rebuild` and the latched topic `~/table`.

    Does not own how gaits are found and stored (`library.GaitLibrary`).
    """

    def __init__(self) -> None:
        """Declare the parameters; `configure` does the rest."""
        super().__init__("gait_library", SETTINGS)
        self._blends = Blends(lambda wanted: self._found(wanted, Selection.INTERPOLATED))

    def configure(self) -> None:
        """Load the library and offer it.

        Raises:
            ConfigurationError: the walker's file can't be used, or the cache folder is in no home.
            GaitFileError: the cache folder is missing, a symbolic link or not writable.
        """
        folder = self.parameters["cache_folder"]
        walker = walker_of(self.parameters["walker_file"])
        self._library = GaitLibrary(walker, named_path(folder) if folder else None, writable=True)
        for problem in self._library.problems():
            self.get_logger().warning(f"gait file set aside: {problem}")
        self._blends.forget()
        self._optimizer = self.connect(OptimizeGait, self.parameters["optimizer_service"])
        self._table = self.create_publisher(GaitTable, "~/table", LATCHED)
        self.serve(GetGait, "~/get_gait", self._get)
        self.serve(ListGaits, "~/list_gaits", self._list)
        self.serve(Rebuild, "~/rebuild", self._rebuild)
        self.diagnostics.add("gaits", self._gaits_finding)
        self.diagnostics.add("optimizer", self._optimizer_finding)

    def activate(self) -> None:
        """Publish the table."""
        self._publish_table()
        self.get_logger().info(with_fields("ready", gaits=len(self._library.gaits())))

    def deactivate(self) -> None:
        """Give up what is being blended."""
        self._blends.give_up()

    def cleanup(self) -> None:
        """Say nothing more about the library; `configure` reads it anew."""
        self.diagnostics.remove("gaits")
        self.diagnostics.remove("optimizer")

    def close(self) -> None:
        """Shut down."""
        super().close()
        self._blends.close()

    async def _get(self, request: GetGait.Request, response: GetGait.Response) -> None:
        wanted = self._wanted(request.speed, request.spring_mode)
        selection = parse_selection(request.selection or Selection.INTERPOLATED)
        gait, response.source, how = await self._find(wanted, selection)
        response.gait = gait_to_message(gait)
        if response.source == Source.INTERPOLATED:
            response.gait.method = response.source
        response.message = f"{wanted.speed:.4f} m/s asked for, {gait.speed:.4f} m/s delivered: {how}"

    def _wanted(self, speed: float, mode: str) -> GaitRequest:
        return GaitRequest.for_speed(speed, mode, self.parameters["points"])

    async def _find(self, wanted: GaitRequest, selection: Selection) -> tuple[Gait, str, str]:
        """Return a gait, its source, and a sentence about that; solved now when the library lacks it."""
        try:
            gait, source = await self._look_up(wanted, selection)
        except GaitNotFoundError as error:
            if selection is Selection.NEAREST:
                raise
            self.get_logger().info(
                with_fields("asking the optimizer", speed=wanted.speed, spring_mode=wanted.spring_mode),
                throttle_duration_sec=1.0,
            )
            try:
                gait, warning = await self._solve(wanted)
            except ServiceUnavailableError as away:
                raise ServiceUnavailableError(f"{error}; {away}") from away
            reason = "" if selection is Selection.EXACT else str(error)
            return gait, OPTIMIZER, "; ".join(filter(None, ("solved now", reason, warning)))
        blended = source is Source.INTERPOLATED
        return gait, source.value, gait.report.message if blended else f"from the {source.value}"

    async def _look_up(self, wanted: GaitRequest, selection: Selection) -> tuple[Gait, Source]:
        """Return what the library has without the optimizer.

        Raises:
            GaitNotFoundError: nothing that fits.
        """
        if selection is not Selection.INTERPOLATED:
            return self._found(wanted, selection)
        blend = self._blends.find(wanted)
        await self.finished(blend)
        return blend.result()

    def _found(self, wanted: GaitRequest, selection: Selection) -> tuple[Gait, Source]:
        return self._library.find(
            wanted.speed, wanted.spring_mode, selection, tolerance=EXACT_SPEED_TOLERANCE
        )

    async def _solve(self, wanted: GaitRequest) -> tuple[Gait, str]:
        """Have a gait solved, store it, and return it with a warning where it can't be stored.

        Raises:
            WalkOptimizerError: the optimizer refused or is not there.
        """
        request = OptimizeGait.Request(
            speed=wanted.speed, spring_mode=wanted.spring_mode.value, points=wanted.points
        )
        answer = await self.call(self._optimizer, request, self.parameters["optimizer_timeout"])
        if not answer.success:
            raise SolveFailedError(answer.message)
        gait = gait_from_message(answer.gait, answer.report, self._library.walker, wanted)
        warning = self._store(gait)
        self._blends.forget()
        self._publish_table()
        return gait, warning

    def _store(self, gait: Gait) -> str:
        """Store a gait, and return why it can't be; empty if it can. It is served nevertheless."""
        try:
            self._library.store(gait)
        except GaitNotWritableError as error:
            self.get_logger().warning(f"{error}; {_FREE_SPACE}")
            return str(error)
        return ""

    async def _list(self, _request: ListGaits.Request, response: ListGaits.Response) -> None:
        response.table = self._table_message()
        response.message = f"{len(response.table.gaits)} gaits"

    async def _rebuild(self, request: Rebuild.Request, response: Rebuild.Response) -> None:
        speeds = list(request.speeds) or _TABLE.table_speeds()
        modes = request.spring_modes or [mode.value for mode in SpringMode]
        if len(speeds) * len(modes) > _MOST_REBUILT:
            raise InvalidRequestError(
                f"{len(speeds)} speeds times {len(modes)} spring modes are too many to rebuild, allowed "
                f"are {_MOST_REBUILT} gaits; ask for them in parts"
            )
        wanted = [self._wanted(speed, mode) for mode in modes for speed in speeds]
        failures = [failure for one in wanted if (failure := await self._failure_of(one))]
        response.rebuilt = len(wanted) - len(failures)
        response.message = f"{response.rebuilt} of {len(wanted)} gaits solved"
        if failures:
            raise SolveFailedError("; ".join([response.message, *failures]))

    async def _failure_of(self, wanted: GaitRequest) -> str:
        """Solve a gait again, and return why that or storing it failed, if it did."""
        try:
            _, problem = await self._solve(wanted)
        except WalkOptimizerError as error:
            problem = str(error)
        return f"{wanted.speed:.4f} m/s, {wanted.spring_mode}: {problem}" if problem else ""

    def _publish_table(self) -> None:
        self._table.publish(self._table_message())

    def _table_message(self) -> GaitTable:
        return GaitTable(
            stamp=self.get_clock().now().to_msg(),
            walker=self._library.walker.fingerprint(),
            gaits=[summary_to_message(summary) for summary in self._library.summaries()],
        )

    def _gaits_finding(self) -> Finding:
        entries, problems = self._library.entries(), self._library.problems()
        sources = Counter(entry.source.value for entry in entries)
        values: dict[str, object] = {source.value: sources[source] for source in Source}
        values |= {"set_aside": len(problems), "folder": self._library.folder}
        unsaved = self._library.unsaved()
        if unsaved:
            text = f"{len(unsaved)} gaits are in memory only: {unsaved[0]}; {_FREE_SPACE}"
            return Finding(Level.WARN, text, values | {"in_memory_only": len(unsaved)})
        if problems:
            return Finding(Level.WARN, f"{len(problems)} gait files set aside: {problems[0]}", values)
        if not entries:
            return Finding(Level.WARN, "no gaits yet: every request has to be solved", values)
        return Finding(Level.OK, f"{len(entries)} gaits", values)

    def _optimizer_finding(self) -> Finding:
        return self._optimizer.finding(
            "optimizer",
            "only gaits of the library can be had; start gait_optimizer, or set `optimizer_service` to its "
            "service",
        )


def main() -> int:
    """Run the node."""
    return run_node(GaitLibraryNode)


if __name__ == "__main__":
    sys.exit(main())
