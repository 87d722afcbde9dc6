"""What is written of a flight: tables, truth, verdict, picture."""
