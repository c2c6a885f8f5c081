"""What shared libraries of three formats export, read from their headers (ELF, PE/COFF and Mach-O specifications)."""

from struct import unpack_from


def exported(library: bytes) -> tuple[str, set[str]]:
    """Format and machine, and the exported names."""
    if library[:4] == b"\x7fELF":
        return _elf(library)
    if library[:2] == b"MZ":
        return _pe(library)
    assert unpack_from("<I", library)[0] == 0xFEEDFACF
    return _mach_o(library)


def _text(content: bytes, offset: int) -> str:
    return content[offset : content.index(b"\0", offset)].decode()


def _elf(library: bytes) -> tuple[str, set[str]]:
    (machine,) = unpack_from("<H", library, 18)
    (table,) = unpack_from("<Q", library, 40)
    size, count = unpack_from("<HH", library, 58)
    sections = [unpack_from("<IIQQQQIIQQ", library, table + size * k) for k in range(count)]
    names = set()
    for _, kind, _, _, offset, length, link, *_ in sections:
        if kind == 11:  # dynamic symbols
            for at in range(offset, offset + length, 24):
                name, info, _, section = unpack_from("<IBBH", library, at)
                if section != 0 and info >> 4 in (1, 2):
                    names.add(_text(library, sections[link][4] + name))
    return f"ELF {machine}", names


def _pe(library: bytes) -> tuple[str, set[str]]:
    (start,) = unpack_from("<I", library, 0x3C)
    assert library[start : start + 4] == b"PE\0\0"
    machine, n_sections, _, _, _, optional = unpack_from("<HHIIIH", library, start + 4)
    (directory,) = unpack_from("<I", library, start + 24 + 112)
    sections = [unpack_from("<8xIIII", library, start + 24 + optional + 40 * k) for k in range(n_sections)]

    def place(address: int) -> int:
        return next(raw + address - base for size, base, _, raw in sections if base <= address < base + size)

    (count,) = unpack_from("<I", library, place(directory) + 24)
    (table,) = unpack_from("<I", library, place(directory) + 32)
    addresses = unpack_from(f"<{count}I", library, place(table))
    return f"PE {machine:#x}", {_text(library, place(address)) for address in addresses}


def _mach_o(library: bytes) -> tuple[str, set[str]]:
    _, machine, _, _, n_commands = unpack_from("<IIIII", library)
    position, names = 32, set()
    for _ in range(n_commands):
        command, size = unpack_from("<II", library, position)
        if command == 2:  # symbol table
            table, count, strings = unpack_from("<III", library, position + 8)
            for at in range(table, table + 16 * count, 16):
                name, kind = unpack_from("<IB", library, at)
                if kind & 0x01 and kind & 0x0E and not kind & 0x10:  # external, defined, not private
                    names.add(_text(library, strings + name).removeprefix("_"))
        position += size
    return f"Mach-O {machine:#x}", names
