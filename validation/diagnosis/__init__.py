"""What physics was left out, or which instrument is wrong."""
