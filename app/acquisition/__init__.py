"""One run: planned, checked, played, watched and recorded."""
