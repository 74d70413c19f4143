"""Pages of the main window: one line for each, in the order of the list.

The list, the keys Ctrl+1, Ctrl+2, ..., the page that the next start shows, and how a page is made,
reset, restored and closed follow from its line and its class (``dearig.window.session.page.Page``).
"""

from __future__ import annotations

from pkgutil import resolve_name

from dearig.window.session.page import Page

__all__ = ["PAGES"]

PAGES: tuple[type[Page], ...] = tuple(
    resolve_name(name)
    for name in (
        "dearig.window.rig.page:RigPage",
        "dearig.window.sequence.page:SequencePage",
        "dearig.window.run.page:RunPage",
        "dearig.window.recordings.page:RecordingsPage",
        "dearig.window.study.page:StudyPage",
        "dearig.window.follow.page:FollowPage",
        "dearig.window.campaign.page:CampaignPage",
    )
)
