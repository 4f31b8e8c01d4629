"""What a report of many runs is made of: curves, figures and a page."""
