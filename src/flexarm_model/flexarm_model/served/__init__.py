"""The served form: linear reduced models about poses, their modes followed, kept, scheduled."""
