"""What a campaign will take: each sequence checked by the gate, total time and disk."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dearig.acquisition.plan import Plan, plan
from dearig.config.campaignfile import Campaign, digest_of
from dearig.config.modelfile import load_model
from dearig.config.rigfile import RigFile
from dearig.drivers.gate import Margin
from dearig.errors import InputError
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress, quiet
from dearig.recording.writing.disk_space import LEFT_FREE, estimate_bytes, free_bytes

__all__ = ["Forecast", "foresee", "survey"]


@dataclass(frozen=True)
class Forecast:
    """Sizes of a campaign before anything is played.

    ``durations`` in s, ``sizes`` in bytes of the recordings that are kept, ``digests`` and
    ``refused`` (why a run cannot be played, "" for one that can) are of the runs, in their order.
    ``seconds`` is the time of all runs and rests, without computations between them; ``size`` the
    bytes of the recordings that are kept, with one more that is not reduced yet; ``free`` the free
    bytes of the disk. ``margins`` are the smallest distances to each limit of the gate.
    """

    durations: tuple[float, ...]
    digests: tuple[str, ...]
    seconds: float
    size: int
    free: int
    margins: tuple[Margin, ...]
    sizes: tuple[int, ...]
    refused: tuple[str, ...]

    def check_room(self, folder: Path) -> None:
        """Raise ``InputError`` where the recordings do not fit on the disk of ``folder``."""
        if self.size + LEFT_FREE > self.free:
            raise InputError(
                f"the campaign needs {self.size / 1e9:.3g} GB and the disk of {folder} has "
                f"{self.free / 1e9:.3g} GB free, of which {LEFT_FREE / 1e9:.2g} GB must stay free: "
                f"free some space, or keep fewer recordings whole with [keep] every"
            )


def foresee(
    campaign: Campaign,
    rig_file: RigFile,
    folder: Path,
    model: Actuator | None = None,
    film: str = "",
    progress: Progress = quiet,
) -> Forecast:
    """Return what ``campaign`` takes with this rig file, as ``survey`` does.

    Raises ``InputError`` for the first run that is refused.
    """
    found = survey(campaign, rig_file, folder, model, film, progress, whole=False)
    for run, reason in zip(campaign.runs, found.refused, strict=False):
        if reason:
            # a fault of the plan names the run itself
            own = reason.startswith(campaign.source)
            raise InputError(reason if own else f"run {run.name}: {reason}")
    return found


def survey(
    campaign: Campaign,
    rig_file: RigFile,
    folder: Path,
    model: Actuator | None = None,
    film: str = "",
    progress: Progress = quiet,
    *,
    whole: bool = True,
) -> Forecast:
    """Return what ``campaign`` takes with this rig file, and which runs are refused.

    Each different sequence is checked by the gate once, as a run does it; ``model`` and ``film`` as
    of a run. With ``whole`` False it ends at the first run that is refused. Raises ``InputError``
    where the first model of a validation after runs cannot be read: no run would have an error.
    """
    if campaign.validate and campaign.model is not None:
        load_model(campaign.model)
    card, channels = rig_file.card, len(rig_file.terminals())
    known: dict[str, tuple[float, int, str]] = {}
    margins: dict[str, Margin] = {}
    durations, digests, sizes, refused = [], [], [], []
    largest = 0
    for i, run in enumerate(campaign.runs):
        progress("planning", i / len(campaign.runs))
        digest, duration, needs, reason = "", 0.0, 0, ""
        try:
            loaded = campaign.load(run)
        except InputError as error:
            reason = str(error)
        else:
            digest = digest_of(loaded)
            if digest not in known:
                planned = plan(loaded, rig_file, model, film)
                known[digest] = planned.duration, planned.rows, _refusal(planned)
                for margin in () if planned.waveform is None else planned.waveform.margins:
                    before = margins.get(margin.quantity)
                    if before is None or _part(margin) > _part(before):
                        margins[margin.quantity] = margin
            duration, samples, reason = known[digest]
            needs = estimate_bytes(channels, card.sample_rate_Hz, samples, card.average)
        largest = max(largest, needs)
        durations.append(duration)
        digests.append(digest)
        sizes.append(needs if campaign.is_kept(run) else 0)
        refused.append(reason)
        if reason and not whole:
            break
    size = sum(sizes) + (largest if campaign.keep_every > 1 else 0)
    rests = campaign.rest * (len(campaign.runs) - 1)
    there = next(p for p in (folder, *folder.absolute().parents) if p.is_dir())
    return Forecast(
        tuple(durations), tuple(digests), sum(durations) + rests, size, free_bytes(there / "x"),
        tuple(margins.values()), tuple(sizes), tuple(refused),
    )  # fmt: skip


def _refusal(planned: Plan) -> str:
    """Return why the gate refuses what is ``planned``, "" where it does not."""
    try:
        planned.admitted()
    except InputError as error:
        return str(error)
    return ""


def _part(margin: Margin) -> float:
    return margin.reached / margin.allowed if margin.allowed else 0.0
