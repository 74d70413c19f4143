"""Editing of text files: editor, dialogs, questions before text is lost."""
