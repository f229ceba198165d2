"""The screen as the daemon serves it, and every sentence that it can say.

Modules in reading order: `kept_choices`, `joined_files`, `screen_words`.

Its files are those of device/web/static; nothing here measures or decides.
"""
