"""Physics that several effects share."""
