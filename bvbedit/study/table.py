def to_csv(rows):
    names=[]
    for r in rows:
        for k in r:
            if k not in names: names.append(k)
    return "\n".join([",".join(names)]+[",".join(str(r.get(k,"")) for k in names) for r in rows])+"\n"
