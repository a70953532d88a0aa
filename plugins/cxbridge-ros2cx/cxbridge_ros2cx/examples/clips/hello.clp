; Greets, counts the ticks, and says good-bye.

(defglobal ?*ticks* = 0)

(defrule greet
  =>
  (printout info "hello" crlf)
  (assert (greeted)))

; each tick has its own fact (time SECONDS)
(defrule count-ticks
  (time ?)
  =>
  (bind ?*ticks* (+ ?*ticks* 1)))

(defrule say-good-bye
  (executive-finalize)
  =>
  (printout info "good-bye after " ?*ticks* " ticks" crlf))
