"""Files written after a flight: tables, truth, verdict, picture."""
