"""What people read: tables, figures in characters, phrases, progress; text in, nothing asked, nothing decided."""
