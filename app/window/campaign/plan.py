"""Plan of a campaign in the window: its text, its runs, and what the gate says of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from PySide6.QtCore import QTimer, Signal, Slot
from PySide6.QtWidgets import QPlainTextEdit, QWidget

from dearig.acquisition.rigs import is_simulated
from dearig.batch.forecast import Forecast, survey
from dearig.batch.journal import REQUESTS, read_lines
from dearig.batch.queue import REQUEST_KINDS, Queue
from dearig.batch.watching import seen
from dearig.config.campaignfile import EXAMPLE, Campaign, parse_campaign
from dearig.config.rigfile import RigFile
from dearig.config.toml_input import read_text
from dearig.errors import InputError, Interrupted
from dearig.progress import Progress, quiet
from dearig.report.pages.campaign import write_campaign_report
from dearig.window.campaign.plan_form import PlanForm
from dearig.window.documents.toml_editor import EditorWords, TomlEditor
from dearig.window.jobs.background import Background
from dearig.window.session.state import Session

__all__ = [
    "OpenedCampaign",
    "PlanEditor",
    "PlanSurvey",
    "Surveyor",
    "open_campaign",
    "with_requests",
    "write_report",
]

_WAIT = 400  # ms after a change of the text, before it is surveyed
_WORDS = EditorWords(
    what="plan",
    caption="Pl&an",
    tip="Sequence, grid of its keys, repeats, rests, order, and what is computed after each run",
    open_tip="Read a plan file; sequence files that it names lie next to it",
    example_tip="Replace the plan by a commented one with every key",
    kinds="Plans (*.toml)",
)


class PlanEditor(TomlEditor):
    """Plan as a form, and the text of its file, which both edit."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, _WORDS, EXAMPLE, parent)
        self.edit.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.form = PlanForm()
        self.tabs = self.put_form(self.form)
        self.form.changed.connect(self.take)
        self.changed.connect(self._show_form)
        self._show_form()

    def set_fixed(self, fixed: bool) -> None:
        """Make the plan that of a campaign that was begun: it can be read and saved only."""
        self.edit.setReadOnly(fixed)
        self.form.setEnabled(not fixed)
        self.open_button.setEnabled(not fixed)
        self.example_button.setEnabled(not fixed)

    @Slot()
    def _show_form(self) -> None:
        self.form.show_plan(self.toml, self.folder)


@dataclass(frozen=True)
class SurveyRequest:
    """What is surveyed: the plan ``toml`` with its files in ``folder``, for a rig and a film.

    ``out`` is a folder on the disk of the recordings. A campaign that was ``begun`` has taken some
    of their space already.
    """

    toml: str
    folder: Path
    address: str
    rig_file: RigFile
    configuration: str
    film: str
    out: Path
    begun: bool


@dataclass(frozen=True)
class PlanSurvey:
    """Runs of a plan, and their forecast, None while it is made; or the ``trouble`` of the plan."""

    request: SurveyRequest
    campaign: Campaign | None = None
    forecast: Forecast | None = None
    trouble: str = ""

    @property
    def refused(self) -> int:
        """Number of runs that cannot be played."""
        return 0 if self.forecast is None else sum(map(bool, self.forecast.refused))


@dataclass(frozen=True)
class OpenedCampaign:
    """A campaign that was begun: its plan and folder, state, and how the last session ended.

    ``plan_folder`` is where the files lie that the plan names.
    """

    folder: Path
    toml: str
    plan_folder: Path
    queue: Queue
    status: str
    reason: str


def write_report(folder: Path, progress: Progress = quiet) -> Path:
    """Write the report of the campaign in ``folder`` next to its journal."""
    progress("writing the report", 0.0)
    return write_campaign_report(seen(folder), folder / "report.html")


def open_campaign(folder: Path) -> OpenedCampaign:
    """Read the campaign in ``folder``.

    Raises ``InputError`` for a folder without a campaign.
    """
    outcome = seen(folder)
    if outcome.status in ("running", "paused"):
        raise InputError(
            f"the campaign in {folder} is played by another program; it can be continued here once "
            f"that has ended"
        )
    queue = outcome.queue
    toml = read_text(folder / "plan.toml", "plan")
    plan_folder = Path(queue.plan_folder) if queue.plan_folder else folder
    return OpenedCampaign(folder, toml, plan_folder, queue, outcome.status, outcome.reason)


def with_requests(queue: Queue, folder: Path) -> Queue:
    """Return ``queue`` as it will be when the requests in ``folder`` are taken."""
    asked = read_lines(folder / REQUESTS, tolerant=True)[queue.requests :]
    if not asked:
        return queue
    runs = {name: replace(run) for name, run in queue.runs.items()}
    soon = replace(queue, runs=runs, order=list(queue.order))
    for number, entry in enumerate(asked, start=queue.requests + 1):
        if entry["event"] in REQUEST_KINDS:
            run = str(entry.get("run", ""))
            soon.take({"event": "request", "number": number, "what": entry["event"], "run": run})
    return soon


class Surveyor(Background):
    """Surveys plans in a thread, the newest one; ``unfolded`` carries its runs before the end.

    ``done`` carries the ``PlanSurvey``, ``progressed`` the part that is done.
    """

    unfolded = Signal(object)
    progressed = Signal(float)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._wanted = 0
        self._request: SurveyRequest | None = None
        self._timer = QTimer(self, singleShot=True, interval=_WAIT)
        self._timer.timeout.connect(self._begin)

    @property
    def waits(self) -> bool:
        """True while a plan waits or is surveyed."""
        return self.busy or self._timer.isActive()

    def ask(self, request: SurveyRequest, soon: bool) -> None:
        """Survey ``request`` now, or ``soon``, when nothing has changed for a moment."""
        self._wanted += 1
        self._request = request
        self._timer.start(_WAIT if soon else 0)

    def drop(self) -> None:
        """End the survey; it is not told."""
        self._wanted += 1
        self._timer.stop()

    def close(self) -> None:
        """End the survey, and wait for the thread."""
        self.drop()
        super().close()

    @Slot()
    def _begin(self) -> None:
        request, number = self._request, self._wanted
        if request is None:
            return

        def progress(stage: str, part: float) -> None:  # noqa: ARG001
            if self._wanted != number:
                raise Interrupted("another plan is surveyed")
            self.progressed.emit(part)

        self.start(lambda: self._survey(request, progress))

    def _survey(self, request: SurveyRequest, progress: Progress) -> PlanSurvey:
        found = PlanSurvey(request)
        try:
            campaign = parse_campaign(request.toml, "the plan", request.folder)
        except InputError as error:
            return replace(found, trouble=str(error))
        found = replace(found, campaign=campaign)
        progress("planning", 0.0)
        self.unfolded.emit(found)
        try:
            forecast = survey(
                campaign, request.rig_file, request.out, film=request.film, progress=progress
            )
            if not request.begun:
                forecast.check_room(request.out)
        except InputError as error:
            return replace(found, trouble=str(error))
        if not is_simulated(request.address) and not request.rig_file.film.name:
            return replace(
                found, forecast=forecast,
                trouble="no film is declared: give [film] of the rig file a name",
            )  # fmt: skip
        return replace(found, forecast=forecast)
