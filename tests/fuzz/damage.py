"""Ways to damage a file."""

import re
import struct

from .seeds import repack

#: Numbers that readers stumble over.
_AWKWARD = [
    *(0, 1, -1, 2**7, 2**8 - 1, 2**15, 2**16 - 1),
    *(2**31 - 1, 2**32 - 1, 2**63 - 1, -(2**31)),
]


def damaged(content, random):
    """Return the content of a file with one to four kinds of damage."""
    content = bytearray(content)
    for _ in range(random.choice([1, 1, 1, 2, 4])):
        # Headers are where the damage is done.
        end = max(len(content), 1)
        if random.random() >= 0.5:
            end = min(end, 256)
        at = random.randrange(end)
        kind = random.randrange(7)
        if kind == 0 and content:
            content[at] ^= 1 << random.randrange(8)
        elif kind == 1:
            written = random.randbytes(random.randrange(1, 9))
            content[at : at + random.randrange(1, 9)] = written
        elif kind == 2:
            del content[at:]
        elif kind == 3:
            del content[at : at + random.randrange(1, 200)]
        elif kind == 4:
            content[at:at] = content[at : at + random.randrange(1, 200)]
        elif kind == 5:
            width = random.choice(["<i", ">i", "<q", ">q", "<h", ">h"])
            size = struct.calcsize(width)
            number = random.choice(_AWKWARD) % 2 ** (8 * size - 1)
            content[at : at + size] = struct.pack(width, number)
        else:
            content = _with_another_number(content, random)
    return bytes(content)


def _with_another_number(content, random):
    numbers = list(re.finditer(rb"\d+", bytes(content)))
    if not numbers:
        return content
    number = random.choice(numbers)
    other = random.choice([str(n) for n in _AWKWARD] + ["1e400", "nan", "-0", "x", ""])
    return content[: number.start()] + other.encode() + content[number.end() :]


def forged(content, random):
    """Return a model file with damage in one member and a digest that fits all the same."""
    target = random.random()

    def change(name, member):
        if name == "schema.json":
            if target < 0.5:
                for _ in range(random.choice([1, 1, 3])):
                    member = bytes(_with_another_number(bytearray(member), random))
            return member
        if target > 0.4 and random.random() < 0.3:
            # The numbers of an array, and now and then its header.
            start = 128 if random.random() < 0.8 else 0
            return member[:start] + damaged(member[start:], random)
        return member

    return repack(content, change)
