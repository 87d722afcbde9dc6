"""What is said and saved: verdict, JSON, pictures, aircraft files."""
