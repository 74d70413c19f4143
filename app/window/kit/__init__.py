"""Building blocks of the window: theme, widgets, forms and fields."""
