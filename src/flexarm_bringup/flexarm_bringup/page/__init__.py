"""What every command reports with: tables, figures and checks on one page."""
