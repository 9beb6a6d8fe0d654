"""The dialogs: definitions of parameters and outputs, help, and the values that users enter."""
