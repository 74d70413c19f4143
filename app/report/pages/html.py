"""HTML report in one file, for screens, phones and paper."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dearig.analysis.outcomes import IdentifyOutcome, pooled_over_noise
from dearig.printable import printable
from dearig.report.figures.channels import channel_figure
from dearig.report.figures.data import Column, csv_url, figure_columns, to_csv
from dearig.report.figures.export import svg
from dearig.report.figures.parameters import (
    branches_figure,
    correlation_columns,
    correlation_figure,
    parameter_columns,
    parameters_figure,
    starts_columns,
    starts_figure,
)
from dearig.report.figures.recordings import comparison_figure, loop_figure
from dearig.report.figures.residual import residual_panels
from dearig.report.figures.style import MODEL
from dearig.report.made import made, made_now, one_time
from dearig.report.pages.head import head_of, origins_of
from dearig.report.pages.pdf import check_browser, is_pdf, write_pdf
from dearig.report.pages.seal import POLICY, sealed
from dearig.report.stored import Outcome, stored, stored_url
from dearig.report.text.bands import band_texts
from dearig.report.text.channels import channel_errors, channel_title
from dearig.report.text.numbers import NO_VALUE, seconds, significant
from dearig.report.text.sentences import (
    describe_model,
    fit_is_rejected,
    identify_summary,
    validate_summary,
    warnings_of,
)
from dearig.report.text.tables import (
    WORD_MAX,
    Table,
    branch_trials,
    by_thesis_table,
    error_table,
    parameter_table,
    spring_candidates,
    thesis_error_table,
)
from dearig.units import SHOWN

if TYPE_CHECKING:  # jinja2 and matplotlib are loaded by the command that writes a report
    from markupsafe import Markup
    from matplotlib.figure import Figure

    from dearig.analysis.outcomes import Comparison, Published, ValidateOutcome
    from dearig.model.fitting import Identification

__all__ = [
    "Picture",
    "fitted_rows",
    "picture",
    "prefixes",
    "write_demo_report",
    "write_identify_report",
    "write_page",
    "write_validate_report",
]

#: Sections from which on a page has a list of them.
_CONTENTS_MIN = 4
#: Places after separators, where a long name may be broken.
_SEPARATED = re.compile(r"(?<=[-.:,;=@+])(?=[^\W\d])|(?<=[_/\\])(?=\w)")
#: Where the list of contents is put; escaped text cannot contain it.
_CONTENTS_PLACE = "<!-- contents -->"


@dataclass(frozen=True)
class Picture:
    """Figure of a page: its prefix for identifiers, number, caption, and columns of its data.

    ``columns`` is None for the curves as drawn.
    """

    figure: Figure
    prefix: str
    caption: str
    columns: Sequence[Column] | None

    @property
    def number(self) -> str:
        """The number of the figure on its page."""
        return self.prefix.removeprefix("f")

    @property
    def svg(self) -> Markup:
        """The drawing."""
        from markupsafe import Markup

        # matplotlib has escaped all text in the drawing, and the label is an escaped attribute
        return Markup(svg(self.figure, self.prefix, self.caption))  # noqa: S704

    @property
    def data(self) -> str:
        """The address that holds the data as CSV."""
        columns = figure_columns(self.figure) if self.columns is None else self.columns
        return csv_url(to_csv(columns))


@dataclass(frozen=True)
class Side:
    """Tables that are side by side where there is room."""

    title: str
    tables: tuple[Table, ...]


@dataclass(frozen=True)
class Part:
    """Values of one outcome for the template; empty tuples leave their sections out."""

    title: str
    lead: str
    summary: tuple[str, ...]
    warnings: tuple[str, ...]
    errors: tuple[Side, ...]
    channels: tuple[Table, ...]
    channel_pictures: tuple[Picture, ...]
    overview: tuple[Picture, ...]
    parameters: tuple[Table, ...]
    parameter_pictures: tuple[Picture, ...]
    springs: tuple[Table, ...]
    branches: tuple[Table, ...]
    branch_pictures: tuple[Picture, ...]
    pictures: tuple[tuple[str, tuple[Picture, ...]], ...]
    residuals: tuple[tuple[str, tuple[Picture, ...]], ...]
    provenance: tuple[tuple[str, tuple[str, ...]], ...]
    film: bool
    rest_length_known: bool


def write_identify_report(outcome: IdentifyOutcome, path: str | Path) -> Path:
    """Write the report of an identification to ``path``. Raises ``InputError``."""
    return write_page(path, "report.html.j2", fits_contents((outcome,)), (outcome,))


def write_validate_report(outcome: ValidateOutcome, path: str | Path) -> Path:
    """Write the report of a validation to ``path``. Raises ``InputError``."""
    return write_page(path, "report.html.j2", fits_contents((outcome,)), (outcome,))


def write_demo_report(
    identify: IdentifyOutcome, validate: ValidateOutcome, path: str | Path
) -> Path:
    """Write an identification and a validation of its model as one page. Raises ``InputError``."""
    if {c.name for c in identify.validation} <= {c.name for c in validate.comparisons}:
        identify = replace(identify, validation=())  # the other half shows them
    both = (identify, validate)
    return write_page(path, "report.html.j2", fits_contents(both), both)


def fits_contents(
    outcomes: Sequence[IdentifyOutcome | ValidateOutcome],
) -> Callable[[], dict[str, Any]]:
    """Return what makes the values of a page with identifications and validations."""

    def contents() -> dict[str, Any]:
        names = prefixes()
        compared: list[Comparison] = []
        parts = []
        for outcome in outcomes:
            if isinstance(outcome, IdentifyOutcome):
                parts.append(_identify_part(outcome, names))
                compared += (*outcome.train, *outcome.validation)
            else:
                parts.append(_validate_part(outcome, names))
                compared += outcome.comparisons
        return {
            "parts": tuple(parts),
            "title": outcomes[0].title,
            "lead": " and ".join(p.lead for p in parts).capitalize(),
            "head": head_of(origins_of(compared)),
            "film": all(p.film for p in parts),
            "rest_length_known": any(p.rest_length_known for p in parts),
        }

    return contents


def write_page(
    path: str | Path,
    template: str,
    contents: Callable[[], dict[str, Any]],
    outcomes: Sequence[Outcome] = (),
) -> Path:
    """Write ``template`` with ``contents`` to ``path``. Raises ``InputError``.

    ``contents`` returns the values of the template, among them those of every page: ``title``,
    ``lead`` (the kind of the report) and ``head`` (a ``dearig.report.pages.head.Head``). A list of
    the sections that follow, which are its ``h2`` with an ``id``, is put where the template asks
    for it. A ``path`` that ends in ``.pdf`` gets the page as it is printed. ``outcomes`` are put
    into the page, so that it and its figures can be made again from it.
    """
    from dearig.recording.files import check_output, replaced_when_done

    def page() -> str:
        with one_time():
            held = stored_url(stored(outcomes, made() or made_now())) if outcomes else ""
            return _render(template, {**contents(), "stored": held})

    path = check_output(path, overwrite=True)  # before seconds are spent on figures
    if is_pdf(path):
        check_browser()
        return write_pdf(page(), path)
    text = page()
    with replaced_when_done(path, overwrite=True) as partial:
        # bytes of a file name that are not text are shown as ?
        partial.write_text(text, encoding="utf-8", errors="replace", newline="\n")
    return path


def _render(template: str, contents: dict[str, Any]) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("dearig.report"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["non_breaking"] = _non_breaking
    environment.filters["breakable"] = _breakable
    page = environment.get_template(template).render(
        contents,
        policy=POLICY,
        contents_place=Markup(_CONTENTS_PLACE),  # noqa: S704
    )
    return sealed(page.replace(_CONTENTS_PLACE, _contents_list(page), 1))


def _contents_list(page: str) -> str:
    """Return a list of links to the sections of ``page`` below it; "" where there are few."""
    # text of others has no such element: the templates escape it
    below = page.partition(_CONTENTS_PLACE)[2]
    found = re.findall(r'<(h[12]) id="([^"]+)">(.*?)</\1>', below, re.DOTALL)
    if len(found) < _CONTENTS_MIN:
        return ""
    rows = []
    for level, name, title in found:
        look = ' class="part"' if level == "h1" else ""
        rows.append(f'<li{look}><a href="#{name}">{title}</a></li>')
    return f'<nav aria-label="Contents"><ol>{"".join(rows)}</ol></nav>'


def _non_breaking(sentence: str) -> str:
    """Return ``sentence`` with non-breaking spaces between numbers and units."""
    return re.sub(
        r"(?<=\d) (?=%|\N{MICRO SIGN}m\b|kPa\b|s\b|min\b|h\b)", "\N{NO-BREAK SPACE}", sentence
    )


def _shown(value: object) -> object:
    """Return text of others without characters that reverse or hide what is around them."""
    is_text = isinstance(value, str) and not hasattr(value, "__html__")
    return printable(str(value), "\n\t") if is_text else value


def _breakable(name: str, longest: int = WORD_MAX) -> Markup:
    """Return ``name`` as HTML whose words of more than ``longest`` characters can be broken.

    They break after separators, and within only where a part is still longer.
    """
    from markupsafe import Markup

    words = []
    for word in re.split(r"(\s+)", printable(str(name))):
        parts = [word] if len(word) <= longest else _SEPARATED.split(word)
        pieces = [p[i : i + longest] for p in parts for i in range(0, len(p), longest)]
        words.append(Markup("<wbr>").join(pieces))  # escapes them
    return Markup("").join(words)


def prefixes() -> Iterator[str]:
    """Yield a different prefix for each figure of a page."""
    return (f"f{n}" for n in count(1))


def _parameter_pictures(fit: Identification, prefixes: Iterator[str]) -> tuple[Picture, ...]:
    """Return the figures of the parameters: intervals, correlation, starts of the search."""
    found: tuple[Picture, ...] = (
        picture(
            parameters_figure(fit),
            prefixes,
            "Parameters with their 95 % intervals. An arrow is an open end; grey parameters "
            "are not determined by the data."
            if fit.covariance.size > 0
            else "Parameters; no intervals were computed.",
            parameter_columns(fit),
        ),
    )
    if fit.covariance.size > 1:
        found += (
            picture(
                correlation_figure(fit.covariance_names, fit.covariance),
                prefixes,
                "Correlation of the fitted parameters. Near 1 or -1 the data determine a "
                "combination of two parameters better than each of them.",
                correlation_columns(fit.covariance_names, fit.covariance),
            ),
        )
    if len(fit.starts) > 1:
        found += (
            picture(
                starts_figure(fit),
                prefixes,
                "What each start of the global search reached on means of the readings, sorted. "
                "Several at one height came to one optimum; the best were followed to their ends.",
                starts_columns(fit),
            ),
        )
    return found


def _identify_part(outcome: IdentifyOutcome, prefixes: Iterator[str]) -> Part:
    fit = outcome.fit
    # the published errors are those of one recording
    published = outcome.published_fit if len(outcome.train) == 1 else None
    errors = [_side("Training: recordings that were fitted", outcome.train, published)]
    errors += _validation_sides(outcome.validation, "Validation: recordings that were not fitted")
    overview, *others = _comparison_pictures(outcome.train, prefixes)
    pictures = [("Training", tuple(others))] if others else []
    if outcome.validation:
        pictures.append(("Validation", _comparison_pictures(outcome.validation, prefixes)))
    parameter_pictures = _parameter_pictures(fit, prefixes)
    branch_tables: tuple[Table, ...] = ()
    branch_pictures: tuple[Picture, ...] = ()
    springs: tuple[Table, ...] = ()
    if outcome.springs:
        springs = (spring_candidates(outcome.springs, outcome.kind),)
    if outcome.trials:
        branch_tables = (branch_trials(outcome.trials, outcome.kind),)
        branch_pictures = (
            picture(
                branches_figure(outcome.trials, outcome.kind),
                prefixes,
                "Error on training and validation data, and the Bayesian information criterion "
                "(BIC) of the training data, against the number of branches.",
            ),
        )
    over = pooled_over_noise(outcome.train)
    return Part(
        title=outcome.title,
        lead="Identification",
        summary=identify_summary(outcome),
        warnings=warnings_of(outcome),
        errors=tuple(errors),
        channels=_channel_tables((*outcome.train, *outcome.validation)),
        channel_pictures=_channel_pictures(outcome.train, prefixes),
        overview=(overview,),
        parameters=(parameter_table(fit, fit_is_rejected(outcome)),),
        parameter_pictures=parameter_pictures,
        springs=springs,
        branches=branch_tables,
        branch_pictures=branch_pictures,
        pictures=tuple(pictures),
        residuals=tuple((c.name, _residual_pictures(c, prefixes)) for c in outcome.train),
        provenance=(
            *fitted_rows(outcome.train, outcome.validation),
            ("Model", (describe_model(fit.model),)),
            ("Model file", (outcome.model_path or "not written",)),
            ("Method", (outcome.method,)),
            ("Converged", ("yes" if fit.converged else "no",)),
            ("Simulations", (f"{fit.simulations:,}",)),
            ("Residual over noise", (NO_VALUE if over is None else significant(over),)),
            ("Residual correlation", (f"{significant(fit.correlation)} samples",)),
            ("Computing time", (seconds(outcome.seconds),)),
        ),
        film=outcome.kind == "film",
        rest_length_known=any(not (e.free or e.is_fixed) for e in fit.estimates),
    )


def _validate_part(outcome: ValidateOutcome, prefixes: Iterator[str]) -> Part:
    worst = max(outcome.comparisons, key=_over_noise)
    overview, *others = _comparison_pictures(outcome.comparisons, prefixes)
    return Part(
        title=outcome.title,
        lead="Validation",
        summary=validate_summary(outcome),
        warnings=warnings_of(outcome),
        errors=tuple(_validation_sides(outcome.comparisons, "By recording")),
        channels=_channel_tables(outcome.comparisons),
        channel_pictures=_channel_pictures((worst,), prefixes),
        overview=(overview,),
        parameters=(),
        parameter_pictures=(),
        springs=(),
        branches=(),
        branch_pictures=(),
        pictures=(("Recordings", tuple(others)),) if others else (),
        residuals=(
            (
                f"{worst.name}, where the error is largest",
                _residual_pictures(worst, prefixes),
            ),
        ),
        provenance=(
            ("Recordings", tuple(c.name for c in outcome.comparisons)),
            ("Samples", (f"{sum(c.errors.samples for c in outcome.comparisons):,}",)),
            ("Model", (outcome.model_name,)),
            ("Model file", (outcome.model_path or "not written",)),
        ),
        film=outcome.kind == "film",
        rest_length_known=False,
    )


def _over_noise(comparison: Comparison) -> float:
    """Return RMS over the noise floor, or the RMS where the floor is unknown."""
    return comparison.errors.rms / (comparison.noise or 1.0)


def _side(title: str, comparisons: Sequence[Comparison], published: Published | None) -> Side:
    ours = error_table("Measured minus model", comparisons)
    theirs = thesis_error_table("By the thesis's formulas, in %", comparisons, published)
    return Side(title, (ours,) if theirs is None else (ours, theirs))


def _validation_sides(comparisons: Sequence[Comparison], alone: str) -> list[Side]:
    groups = by_thesis_table(comparisons, alone)
    return [_side(title, members, None) for title, members in groups]


def picture(
    figure: Figure, prefixes: Iterator[str], caption: str, data: Sequence[Column] | None = None
) -> Picture:
    """Return ``figure`` for a page; ``prefixes`` yields one prefix for each figure.

    ``data`` is what is saved as its data, by default the curves as drawn.
    """
    return Picture(figure, next(prefixes), caption, data)


def band_caption(comparison: Comparison) -> str:
    """Return sentences on the band of a figure of ``comparison``, "" where it has none."""
    if comparison.band is None:
        return ""
    error = comparison.measured - comparison.model
    return " Shaded: " + " ".join(band_texts(comparison.band, comparison.kind, error))


def _comparison_pictures(
    comparisons: Sequence[Comparison], prefixes: Iterator[str]
) -> tuple[Picture, ...]:
    pictures = []
    for c in comparisons:
        shown = SHOWN[c.kind]
        name = f"{c.name} ({c.row})" if c.row else c.name
        error = f"{significant(c.errors.rms * shown.error_factor)} {shown.error_unit} RMS"
        pictures.append(
            picture(
                comparison_figure(c),
                prefixes,
                f"{name}: {shown.drive.lower()}, {shown.quantity.lower()} measured and by the "
                f"model, and measured minus model ({error}).{band_caption(c)}",
            )
        )
        if c.kind == "film":
            caption = f"{name}: nominal stress against stretch."
            pictures.append(picture(loop_figure(c), prefixes, caption))
    return tuple(pictures)


def _channel_tables(comparisons: Sequence[Comparison]) -> tuple[Table, ...]:
    found = channel_errors("Voltage monitor and current", comparisons)
    return () if found is None else (found,)


def _channel_pictures(
    comparisons: Sequence[Comparison], prefixes: Iterator[str]
) -> tuple[Picture, ...]:
    """Draw the electrical channels of the first recording."""
    return tuple(
        picture(
            channel_figure([("model", MODEL, curve)]),
            prefixes,
            f"{c.name}: {channel_title(curve.name)}, means at 200 Hz, with the prediction, and "
            f"measured minus predicted. Gain and offset of the channel are fitted. Dashed lines "
            f"are the noise of a mean.",
        )
        for c in comparisons[:1]
        for curve in c.curves
    )


def fitted_rows(
    train: Sequence[Comparison], validation: Sequence[Comparison]
) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return rows on which recordings and how many of their samples were fitted and validated."""
    fitted, others = (f"{sum(c.errors.samples for c in some):,}" for some in (train, validation))
    return (
        ("Fitted to", tuple(c.name for c in train)),
        ("Samples fitted", (fitted,)),
        ("Validated on", tuple(c.name for c in validation) or ("no recording",)),
        ("Samples validated", (others,)),
    )


def _residual_pictures(comparison: Comparison, prefixes: Iterator[str]) -> tuple[Picture, ...]:
    return tuple(
        picture(figure, prefixes, caption) for figure, caption in residual_panels(comparison)
    )
