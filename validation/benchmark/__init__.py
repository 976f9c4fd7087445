"""The diagnosis judged on cases whose answers are known."""
