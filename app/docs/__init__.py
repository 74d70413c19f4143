"""The documents: which pages there are, and each as HTML for a browser or the window."""

from dearig.docs.pages import HOME, DocumentPage, page_at, page_named, pages
from dearig.docs.site import build, to_html

__all__ = ["HOME", "DocumentPage", "build", "page_at", "page_named", "pages", "to_html"]
