# row: Silent | names nothing and predicts nothing
import rival

rival.main(lambda case: (lambda log, rows: 0.0, []))
