"""Results for people: words, plots and pages."""
