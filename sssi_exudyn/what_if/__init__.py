"""What a recorded run would have been on other snow, on another ski, or by a heavier skier who reacts to it."""
