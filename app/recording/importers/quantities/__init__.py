"""Which quantity and unit a name or a cell states."""
